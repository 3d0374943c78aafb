"""Safety of the pages: the stop on every page, a service that is away, prompts that are never stale, no silent verb."""

import re
import signal
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from bench_service.wall_clock import monotonic_s, pause
from tests.browser.conftest import Watched
from tests.end_to_end.bench_process import BenchProcess

SLOW = {"dwell_s": 86_400.0}
LEGS = [{"target_c": target, "ramp_c_min": 5.0, "least_s": 600.0} for target in (30.0, 25.0, 20.0)]
ANSWER_MS = 2000.0
"""Longest time from the press of a stop to a visible answer [ms]."""


@pytest.fixture(scope="module")
def settings() -> dict[str, str]:
    return {"ask_operator": "true"}


def job_of(service: BenchProcess, job: str) -> dict[str, Any]:
    return service.client.get(f"/api/v1/jobs/{job}").json()


def until(true: Callable[[], bool], seconds: float = 30.0) -> None:
    deadline = monotonic_s() + seconds
    while not true():
        assert monotonic_s() < deadline
        pause(0.05)


def released(service: BenchProcess, stop: str) -> bool:
    said = {"by": "test", "remark": "looked at"}
    return service.client.post(f"/api/v1/benches/sim/stops/{stop}/release", json=said).is_success


def release_all(service: BenchProcess) -> None:
    """Release what stands; a stop from a page is answered before the database has it, so it is waited for."""
    until(lambda: bool(service.client.get("/api/v1/benches/sim").json()["stops"]))
    for stop in service.client.get("/api/v1/benches/sim").json()["stops"]:
        until(lambda stop_id=stop["id"]: released(service, stop_id))


def running(service: BenchProcess) -> str:
    job = service.submit(parameters=SLOW)
    until(lambda: job_of(service, job)["state"] == "running")
    return job


def press_stop(page: Page) -> float:
    """Press the stop; time until the page visibly says that it arrived [ms]."""
    begun = monotonic_s()
    page.get_by_role("button", name="STOP sim").click()
    expect(page.locator("form.stop output")).to_contain_text("has arrived", timeout=10_000)
    return 1000.0 * (monotonic_s() - begun)


def test_the_stop_is_in_view_on_every_page_of_a_small_screen(window: Watched, service: BenchProcess) -> None:
    job = running(service)
    page = window.open("/")
    page.set_viewport_size({"width": 400, "height": 700})
    for path in ("/", f"/jobs/{job}", "/units/SIM-0001", "/campaigns", "/benches/sim/stops", "/nowhere"):
        window.expected = re.compile("status of 404") if path == "/nowhere" else None
        page.goto(window.address + path)
        page.evaluate("scrollTo(0, document.body.scrollHeight)")
        button = page.get_by_role("button", name="STOP sim")
        expect(button).to_be_in_viewport(ratio=1)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), path
    window.expected = re.compile("status of 404")
    page.goto(f"{window.address}/jobs/{job}")
    assert press_stop(page) < ANSWER_MS
    until(lambda: job_of(service, job)["state"] == "cancelled")
    answer = page.locator("form.stop output")
    expect(answer).to_contain_text("safe")
    page.reload()
    expect(answer).to_contain_text("safe")  # the page of a job that ended loads itself anew: the answer stays
    release_all(service)
    page.reload()
    expect(answer).to_be_hidden()  # and says nothing of a stop that was released


def reached(page: Page) -> bool:
    """Whether a press on the middle of the stop's button falls on the button, not on what lies over it."""
    return page.get_by_role("button", name="STOP sim").evaluate(
        "b => { const r = b.getBoundingClientRect();"
        " return document.elementFromPoint(r.x + r.width / 2, r.y + r.height / 2) === b; }"
    )


def stopped_by(page: Page, service: BenchProcess, job: str) -> None:
    expect(page.locator("form.stop output")).to_contain_text("has arrived", timeout=10_000)
    until(lambda: job_of(service, job)["state"] == "cancelled")
    release_all(service)


def test_a_stop_gets_through_an_open_dialog_by_mouse_and_by_keyboard(window: Watched, service: BenchProcess) -> None:
    campaign = {"name": "night", "steps": [{"name": "nothing", "procedure": "no_operation"}]}
    assert service.client.post("/api/v1/campaigns", json=campaign).is_success
    schedule = {"cron": "0 1 * * *", "time_zone": "UTC", "campaign": "night", "unit": "SIM-0001"}
    made = service.client.post("/api/v1/schedules", json=schedule)
    assert made.is_success, made.text
    page = window.open("/campaigns")
    dialog, button = page.get_by_role("dialog"), page.get_by_role("button", name="STOP sim")
    for width, key in ((1280, None), (400, "Shift+Tab")):
        page.set_viewport_size({"width": width, "height": 700})
        job = running(service)
        # The list of stops may still name the one released before, whose link the keyboard reaches first.
        expect(page.get_by_role("link", name="Look and release")).to_have_count(0)
        page.locator("#schedules").get_by_role("button", name="Remove").click()
        expect(dialog).to_be_in_viewport(ratio=1)
        assert reached(page)
        box, bar = dialog.bounding_box(), page.locator("#stopbar").bounding_box()
        assert box is not None
        assert bar is not None
        assert box["y"] >= bar["y"] + bar["height"]
        if key is None:
            button.click(timeout=2000)
        else:
            page.keyboard.press(key)
            expect(button).to_be_focused()
            page.keyboard.press("Enter")
        stopped_by(page, service, job)
        expect(dialog).to_be_visible()
        page.keyboard.press("Escape")
        expect(dialog).to_have_count(0)
        page.reload()
    service.client.delete(f"/api/v1/schedules/{made.json()['id']}")


def test_nothing_on_a_page_lies_over_the_stop(window: Watched, service: BenchProcess) -> None:
    """With the first link focused, asked to cancel, and on the API's own page."""
    job = running(service)
    page = window.open(f"/jobs/{job}")
    page.set_viewport_size({"width": 400, "height": 700})
    page.keyboard.press("Tab")
    expect(page.locator(".skip")).to_be_focused()
    assert reached(page)
    page.get_by_role("button", name="Cancel").click()
    expect(page.get_by_role("dialog")).to_be_visible()
    assert reached(page)
    page.keyboard.press("Escape")
    expect(page.get_by_role("button", name="Cancel")).to_be_focused()
    docs = window.open("/docs")
    assert reached(docs)
    assert press_stop(docs) < ANSWER_MS
    stopped_by(docs, service, job)


def test_the_stop_answers_with_ten_pages_of_running_jobs_open(window: Watched, service: BenchProcess) -> None:
    job = running(service)
    pages = [window.open(f"/jobs/{job}") for _ in range(10)]
    expect(pages[0].locator("#devices")).to_contain_text("Table")
    expect(pages[9].locator("#devices")).to_contain_text("Table")
    assert press_stop(pages[4]) < ANSWER_MS
    for page in pages:
        expect(page.locator("#alerts")).to_contain_text("is stopped")
    until(lambda: job_of(service, job)["state"] == "cancelled")
    release_all(service)


def test_the_stop_works_where_no_script_runs(chromium: Any, service: BenchProcess) -> None:
    context = chromium.new_context(java_script_enabled=False, viewport={"width": 400, "height": 700})
    page = context.new_page()
    page.goto(str(service.client.base_url))
    page.get_by_role("button", name="STOP sim").click()
    expect(page.get_by_role("heading", level=1)).to_contain_text("The stop has arrived")
    context.close()
    (stop,) = service.client.get("/api/v1/benches/sim").json()["stops"]
    assert "without scripts" in stop["reason"]
    release_all(service)


def test_the_stop_works_where_all_other_scripts_are_broken(window: Watched, service: BenchProcess) -> None:
    window.context.route("**/static/*/page.js*", lambda route: route.fulfill(body="throw new Error('broken')"))
    window.expected = re.compile("broken|Failed to load")
    page = window.open("/", ready=False)
    assert press_stop(page) < ANSWER_MS
    release_all(service)


def test_a_refused_release_is_said_and_a_release_asks_once(window: Watched, service: BenchProcess) -> None:
    service.client.post("/api/v1/benches/sim/stop", json={"reason": "try", "by": "test"})
    page = window.open("/")
    form = page.locator(".stops form.release")
    form.get_by_label("Your name").fill("Олена")
    form.get_by_label("What was looked at").fill("table at rest")
    window.context.route("**/release", lambda route: route.fulfill(status=409, json={"detail": "not safe yet"}))
    window.expected = re.compile("status of 409")
    form.get_by_role("button").click()
    expect(form.get_by_role("button")).to_contain_text("Yes, release")
    form.get_by_role("button").click()
    expect(form.locator("output")).to_contain_text("Refused (409): not safe yet")
    window.context.unroute("**/release")
    form.get_by_role("button").click()
    expect(page.locator(".stops .stopped")).to_have_count(0)
    newest = service.client.get("/api/v1/benches/sim/stops").json()["items"][0]
    assert (newest["released_by"], newest["remark"]) == ("Олена", "table at rest")


def test_a_cancel_asks_once_says_what_is_lost_and_keeps_who_and_why(window: Watched, service: BenchProcess) -> None:
    job = running(service)
    page = window.open(f"/jobs/{job}")
    page.get_by_role("button", name="Cancel").click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("cannot be resumed")
    dialog.get_by_role("button", name="Back").click()
    assert job_of(service, job)["state"] == "running"
    page.get_by_role("button", name="Cancel").click()
    dialog.get_by_label("Your name").fill("Олена")
    dialog.get_by_label("Why").fill("wrong unit")
    dialog.get_by_role("button", name="Cancel").click()
    expect(page.locator("#state")).to_have_text("cancelled", timeout=20_000)
    expect(page.locator("[data-note]").first).to_contain_text("by Олена: wrong unit")


def test_a_prompt_is_on_every_page_and_a_stale_answer_is_refused(window: Watched, service: BenchProcess) -> None:
    home, other = window.open("/"), window.open("/campaigns")
    job = service.submit("thermal_cycle", parameters={"legs": LEGS, "power_off_s": 60.0}, seed=3)
    for page in (home, other):
        expect(page.locator(".prompt")).to_be_visible(timeout=20_000)
        expect(page).to_have_title(re.compile("To be done"))
    expect(home.locator("form.stop .status")).to_contain_text("waits for a person")
    old = job_of(service, job)["prompt"]["id"]
    home.locator(".prompt").get_by_label("Remark").fill("x axis up")
    home.locator(".prompt").get_by_role("button", name="Done", exact=True).click()
    expect(other.locator(f'[data-prompt="{old}"]')).to_have_count(0, timeout=20_000)
    expect(other.locator(".prompt")).to_be_visible(timeout=60_000)  # the next one appears by itself
    second = job_of(service, job)["prompt"]["id"]
    assert second != old
    stale = service.client.post(f"/api/v1/jobs/{job}/answer", json={"prompt": old, "done": True})
    assert stale.status_code == 409
    assert "older one" in stale.json()["detail"]
    box = other.locator(".prompt")
    box.get_by_role("button", name="It cannot be done").click()
    expect(box.locator("output")).to_contain_text("Say in the remark")
    box.get_by_label("Remark").fill("the fixture is broken")
    box.get_by_role("button", name="It cannot be done").click()
    until(lambda: job_of(service, job)["state"] == "cancelled")
    page = window.open(f"/jobs/{job}")
    expect(page.locator("[data-note]").first).to_contain_text("the fixture is broken")


def test_a_dead_service_is_seen_at_once_and_its_return_too(
    window: Watched, service: BenchProcess, expect_absence: Callable[[], None]
) -> None:
    page = window.open("/")
    expect(page.locator("form.stop .status")).to_contain_text("idle")
    expect_absence()
    service.kill()
    begun = monotonic_s()
    expect(page.locator("#away")).to_contain_text("does not answer", timeout=5000)
    assert monotonic_s() - begun < 2.0
    expect(page.locator("body")).to_have_class("away")
    page.get_by_role("button", name="STOP sim").click()
    expect(page.locator("form.stop output")).to_contain_text("did NOT arrive", timeout=2000)
    service.start()
    expect(page.locator("body")).not_to_have_class("away", timeout=15_000)


def test_a_service_that_hangs_is_seen_and_the_stop_says_that_nothing_is_known(
    window: Watched, service: BenchProcess, expect_absence: Callable[[], None]
) -> None:
    page = window.open("/")
    expect(page.locator("form.stop .status")).to_contain_text("idle")
    expect_absence()
    service.process.send_signal(signal.SIGSTOP)
    try:
        page.get_by_role("button", name="STOP sim").click()
        expect(page.locator("form.stop output")).to_contain_text("not known whether the stop arrived", timeout=2000)
        expect(page.locator("#away")).to_contain_text("does not answer", timeout=6000)
    finally:
        service.process.send_signal(signal.SIGCONT)
    expect(page.locator("form.stop output")).to_contain_text("has arrived", timeout=10_000)
    expect(page.locator("body")).not_to_have_class("away", timeout=15_000)
    release_all(service)
