"""Every page in every dress: axe finds nothing serious, nothing is wider than the screen, print cuts nothing off."""

import re
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect

from tests.browser.conftest import Watched, address
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.waiting import ended

GRAVE = ("serious", "critical")
DRESSES = [(width, scheme) for width in (400, 1280) for scheme in ("light", "dark")]


@pytest.fixture(scope="module")
def paths(service: BenchProcess) -> dict[str, str]:
    """One page of each kind, by name."""
    http = service.client
    jobs = [ended(service, service.submit(seed=seed, parameters={})) for seed in (7, 9)]
    failed = ended(service, service.submit(seed=8, parameters={"dwell_s": 5.0, "settle_s": 0.5}))
    recording = http.get("/api/v1/recordings", params={"job": jobs[0]["id"]}).json()["items"][0]["id"]
    campaign = {"name": "nothing", "steps": [{"name": "nothing", "procedure": "no_operation"}]}
    assert http.post("/api/v1/campaigns", json=campaign).is_success
    run = http.post("/api/v1/campaigns/nothing/runs", json={"unit": "SIM-0001"}).json()["id"]
    schedule = {"cron": "0 1 * * *", "time_zone": "Europe/Kyiv", "campaign": "nothing", "unit": "SIM-0001"}
    assert http.post("/api/v1/schedules", json=schedule).is_success
    ended(service, service.submit("no_operation"))
    http.post("/api/v1/benches/sim/stop", json={"reason": "for the tests", "by": "test"})
    waiting = service.submit("no_operation")
    return {
        "home": "/",
        "start": "/start?unit=SIM-0001&procedure=calibration_12_orientations",
        "jobs": "/jobs",
        "queue": "/queue",
        "units": "/units",
        "recordings": "/recordings",
        "campaigns": "/campaigns",
        "audit": "/audit",
        "job": jobs[0]["page"],
        "waiting_job": f"/jobs/{waiting}",
        "failed_result": f"/results/{failed['result']}",
        "unit": "/units/SIM-0001",
        "trend": "/units/SIM-0001/trend",
        "recording": f"/recordings/{recording}",
        "campaign_run": f"/campaign-runs/{run}",
        "stops": "/benches/sim/stops",
        "manual": "/benches/sim/manual",
        "mountings": "/mountings",
        "accounts": "/accounts",
        "certificate": "/certificate",
        "enter_calibration": "/units/SIM-0001/calibrations/new",
        "log_in": "/log-in",
        "error": "/jobs/none",
    }


def settled(page: Page) -> None:
    page.wait_for_selector("html[data-ready]")
    expect(page.locator("#alerts")).to_contain_text("for the tests")
    page.wait_for_timeout(150)


def grave(page: Page) -> list[str]:
    found: list[dict[str, Any]] = Axe().run(page).response["violations"]
    return [f"{v['id']}: {v['nodes'][0]['html'][:160]}" for v in found if v["impact"] in GRAVE]


@pytest.mark.parametrize(("width", "scheme"), DRESSES)
def test_axe_finds_nothing_grave_and_no_page_is_wider_than_the_screen(
    chromium: Browser, service: BenchProcess, paths: dict[str, str], width: int, scheme: Any, request: Any
) -> None:
    context = chromium.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
    watched = Watched(context, address(service))
    watched.expected = re.compile("status of 404")
    pictures: str | None = request.config.getoption("--pictures")
    page = context.new_page()
    wrong: list[str] = []
    for name, path in paths.items():
        page.goto(watched.address + path)
        settled(page)
        wrong += [f"{name}: {one}" for one in grave(page)]
        if page.evaluate("document.documentElement.scrollWidth > innerWidth"):
            wrong.append(f"{name}: wider than the screen")
        if pictures:
            page.screenshot(path=Path(pictures) / f"{name}-{width}-{scheme}.png", full_page=False)
    context.close()
    assert wrong == []
    assert watched.complaints() == []


def test_a_printed_page_cuts_nothing_off(window: Watched, paths: dict[str, str]) -> None:
    page = window.open(paths["failed_result"])
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 718, "height": 1000})  # A4 less its margins, at 96 dpi
    right = "[...document.querySelectorAll('main table, main figure')].map(e => e.getBoundingClientRect().right)"
    assert page.evaluate(f"Math.max(...{right}) <= innerWidth + 1")
    assert page.locator("#stopbar").is_hidden()
    expect(page.locator(".verdict")).to_be_visible()


def test_the_keyboard_reaches_the_stop_first_and_then_the_content(window: Watched, paths: dict[str, str]) -> None:
    page = window.open(paths["start"])
    page.keyboard.press("Tab")
    expect(page.locator(".skip")).to_be_focused()
    page.keyboard.press("Tab")
    expect(page.get_by_role("button", name="STOP sim")).to_be_focused()


def test_times_are_local_with_the_zone_named_and_the_theme_can_be_chosen(
    chromium: Browser, service: BenchProcess, paths: dict[str, str]
) -> None:
    context = chromium.new_context(timezone_id="Europe/Kyiv")
    page = context.new_page()
    page.goto(address(service) + paths["job"])
    page.wait_for_selector("html[data-ready]")
    time = page.locator("main time").first
    expect(time).to_have_text(re.compile(r"GMT\+[23]$"))
    expect(time).to_have_attribute("title", re.compile("UTC"))
    page.get_by_text("Settings").click()
    page.get_by_label("Theme").select_option("dark")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(20, 24, 29)"
    context.close()


def test_an_error_is_a_page_for_a_person_and_a_document_for_a_program(window: Watched, service: BenchProcess) -> None:
    window.expected = re.compile("status of 404")
    page = window.open("/jobs/none")
    expect(page.get_by_role("heading", level=1)).to_contain_text("There is no such page")
    expect(page.get_by_role("link", name="To the first page")).to_be_visible()
    answer = service.client.get("/jobs/none")
    assert answer.headers["content-type"] == "application/problem+json"
