"""Pages of a service with accounts: log-in, changes under a name that is proved, and a stop that needs none."""

import re
from collections.abc import Generator

import pytest
from playwright.sync_api import expect

from bench_service.wall_clock import pause
from tests.browser.accounts import PASSWORD, with_account
from tests.browser.conftest import Watched
from tests.end_to_end.bench_process import BenchProcess


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Generator[BenchProcess]:
    with with_account(tmp_path_factory.mktemp("accounts")) as made:
        yield made


def test_a_person_logs_in_starts_a_job_under_her_name_and_logs_out(window: Watched) -> None:
    window.expected = re.compile("status of 401")
    page = window.open("/start", ready=False)
    expect(page).to_have_url(re.compile("/log-in"))
    page.get_by_label("Name", exact=True).fill("ada")
    page.get_by_label("Password").fill(PASSWORD)
    page.locator("#log-in button").click()
    expect(page).to_have_url(f"{window.address}/start", timeout=20_000)
    page.locator('[data-procedure="no_operation"]').click()
    page.get_by_role("button", name="Start", exact=True).click()
    page.wait_for_url(re.compile("/jobs/"))
    expect(page.locator("#main")).to_contain_text("by ada")
    expect(page.locator("body")).not_to_have_class("away")
    page.get_by_text("Settings").click()
    page.get_by_role("button", name="Log out").click()
    expect(page).to_have_url(re.compile("/log-in"))


def test_the_stop_of_the_log_in_page_needs_no_log_in(window: Watched) -> None:
    window.expected = re.compile("status of 401")
    page = window.open("/log-in", ready=False)
    page.get_by_role("button", name="STOP sim").click()
    expect(page.locator("form.stop output")).to_contain_text("has arrived", timeout=10_000)
    pause(2.0)  # the feed was refused by now
    expect(page.locator("body")).not_to_have_class("away")
    expect(page.locator("#away")).to_be_hidden()


def test_the_stop_gets_through_where_the_log_in_has_ended(window: Watched) -> None:
    window.expected = re.compile("status of 401")
    page = window.open("/log-in?next=/campaigns", ready=False)
    page.get_by_label("Name", exact=True).fill("ada")
    page.get_by_label("Password").fill(PASSWORD)
    page.locator("#log-in button").click()
    expect(page.locator("form.stop .status")).not_to_be_empty(timeout=20_000)
    token = page.locator("meta[name=csrf]").get_attribute("content")
    end = "(token) => fetch('/api/v1/session', {method: 'DELETE', headers: {'X-CSRF-Token': token}}).then((a) => a.ok)"
    assert page.evaluate(end, token)
    expect(page.locator("#away")).to_contain_text("the stop works without one", timeout=15_000)
    page.get_by_role("button", name="STOP sim").click()
    expect(page.locator("form.stop output")).to_contain_text("has arrived", timeout=10_000)


def test_an_admin_adds_a_person_and_a_token_that_is_shown_once_and_revokes_it(window: Watched) -> None:
    page = window.open("/log-in?next=/accounts", ready=False)
    page.get_by_label("Name", exact=True).fill("ada")
    page.get_by_label("Password").fill(PASSWORD)
    page.locator("#log-in button").click()
    expect(page).to_have_url(f"{window.address}/accounts", timeout=20_000)
    expect(page.locator("#me")).to_contain_text("ada")
    person = page.locator("#new-account")
    person.get_by_label("Name", exact=True).fill("olena")
    person.get_by_label("Role").select_option("operator")
    person.get_by_label("Team").fill("night")
    person.get_by_label("Password").fill("another long password 8")
    person.get_by_role("button").click()
    row = page.locator('[data-account="olena"]')
    expect(row).to_be_visible()
    row.get_by_label("Role olena").select_option("engineer")
    row.get_by_role("button", name="Change").click()
    expect(page.get_by_label("Role olena")).to_have_value("engineer")
    token = page.locator("#new-token")
    token.get_by_label("Name", exact=True).fill("ci")
    token.get_by_role("button").click()
    secret = page.get_by_label("The new token").input_value()
    assert len(secret) > 20
    answer = page.request.get(f"{window.address}/api/v1/jobs", headers={"Authorization": f"Bearer {secret}"})
    assert answer.ok
    page.get_by_role("button", name="I have it").click()
    expect(page.get_by_label("The new token")).to_have_count(0)
    assert secret not in page.content()
    page.locator('[data-token="ci"]').get_by_role("button", name="Revoke").click()
    page.get_by_role("dialog").get_by_role("button", name="Revoke").click()
    expect(page.locator('[data-token="ci"]')).to_contain_text("revoked")
    page.locator('[data-approval="no_operation"]').get_by_role("button", name="Approve").click()
    expect(page.locator('[data-approval="no_operation"]')).to_contain_text("by ada")
    page.locator('[data-account="olena"]').get_by_role("button", name="Remove").click()
    page.get_by_role("dialog").get_by_role("button", name="Remove").click()
    expect(page.locator('[data-account="olena"]')).to_have_count(0)
