"""Pages of a service with accounts: log-in, changes under a name that is proved, and a stop that needs none."""

import os
import re
import subprocess
import sys
from collections.abc import Callable, Generator

import pytest
from playwright.sync_api import expect

from bench_service.wall_clock import monotonic_s, pause
from tests.browser.conftest import Watched, process
from tests.end_to_end.bench_process import BenchProcess

PASSWORD = "a long and quiet password 7"


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Generator[BenchProcess]:
    """A service with one account, made on its host."""
    made = process(tmp_path_factory.mktemp("accounts"))
    made.start()
    command = [sys.executable, "-m", "bench_service", "user", "add", "ada", "--role", "admin", "--password-file", "-"]
    subprocess.run(
        command, input=f"{PASSWORD}\n", text=True, check=True, env={**os.environ, **made.environment}, timeout=60
    )
    until(lambda: made.client.get("/start").status_code == 303)  # the service looks for new accounts once a second
    yield made
    made.end()


def until(true: Callable[[], bool]) -> None:
    deadline = monotonic_s() + 20.0
    while not true():
        assert monotonic_s() < deadline
        pause(0.05)


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
