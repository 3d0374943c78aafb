"""The day of an operator, with the pages alone: start, watch, decide, find, compare, import, analyse, queue, plan."""

import re
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Watched
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.waiting import ended

FAST = {"dwell_s": 5.0, "settle_s": 0.5}


@pytest.fixture(scope="module")
def calibrated(service: BenchProcess) -> list[dict[str, Any]]:
    return [ended(service, service.submit(seed=seed, parameters={})) for seed in (7, 8)]


def job_in(page: Page) -> str:
    page.wait_for_url(re.compile(r"/jobs/[0-9a-f-]{36}"))
    return page.url.rpartition("/")[2]


def test_three_clicks_start_a_calibration_of_a_known_unit(window: Watched, service: BenchProcess) -> None:
    page = window.open("/")
    clicks = 0
    for role, name in (
        ("link", "Start a job"),
        ("button", re.compile("Calibration in twelve orientations")),
        ("button", "Start"),
    ):
        page.get_by_role(role, name=name, exact=isinstance(name, str)).click()
        clicks += 1
    job = job_in(page)
    assert clicks <= 3
    found = ended(service, job)
    assert (found["procedure"], found["unit"]) == ("calibration_12_orientations", "SIM-0001")
    expect(page.locator(".verdict")).to_be_visible(timeout=20_000)


def test_the_form_follows_the_schema_and_the_preview_follows_the_form(window: Watched, service: BenchProcess) -> None:
    page = window.open("/start?unit=SIM-0001&procedure=calibration_12_orientations")
    preview = page.locator("#preview")
    expect(preview).to_contain_text("15 min of bench time")
    expect(preview).to_contain_text("12 stations")
    expect(preview.locator(".badge").first).to_contain_text("of 0.015 deg/h")
    expect(preview).to_contain_text("cannot be resolved")
    dwell = page.get_by_label("Dwell, s", exact=True)
    expect(dwell).to_have_attribute("placeholder", "70")
    dwell.fill("7000")
    expect(page.locator('[data-field="dwell_s"]')).to_have_class(re.compile("changed"))
    expect(preview).to_contain_text("23.4 h of bench time")
    window.expected = re.compile("status of 422")
    dwell.fill("0.2")
    expect(page.locator('[data-field="dwell_s"] .message')).to_contain_text("greater than or equal to 1")
    expect(page.get_by_role("button", name="Start", exact=True)).to_be_disabled()
    dwell.fill("5")
    page.get_by_label("Settle, s").fill("0.5")
    page.get_by_text("Priority, labels").click()
    page.get_by_label("Labels: name=value").fill("shift=night")
    page.get_by_role("button", name="Start", exact=True).click()
    job = ended(service, job_in(page))
    assert job["requested_parameters"] == FAST
    assert job["labels"] == {"shift": "night"}
    expect(page.locator(".verdict")).to_be_visible()  # the page of the job has loaded itself anew
    page.goto(f"{window.address}/start?from={job['id']}")
    expect(page.get_by_label("Dwell, s", exact=True)).to_have_value("5")


SHOW_INTERLOCKS = """async () => {
  const { interlocks } = await import("/static/interlocks.js");
  const place = document.body.appendChild(Object.assign(document.createElement("ul"), { id: "apart" }));
  const word = (name, bits) => ({ device: "turntable", name, raw: "", bits, since: "2031-05-06T07:08:09Z" });
  const status = [word("interlock 1", ["Open"]), word("mode", [])];
  interlocks(place, { chamber: { door_open: true, tripped: true }, status });
  interlocks(place, { chamber: { door_open: true, tripped: false }, status });
}"""
"""The list of interlocks of readings that a bench of real devices could give, shown twice."""


def test_a_running_job_is_watched_live(window: Watched, service: BenchProcess) -> None:
    job = service.submit(parameters={"dwell_s": 40_000.0})
    page = window.open(f"/jobs/{job}")
    expect(page.locator("#live")).to_contain_text("of bench time left", timeout=20_000)
    expect(page.locator("#table")).to_have_attribute("data-drawn", re.compile(r"-?\d"))
    expect(page.locator("#charts canvas").first).to_be_visible(timeout=20_000)
    expect(page.locator("#samples")).to_contain_text("deg/h")
    page.evaluate(SHOW_INTERLOCKS)  # the simulated bench reports no status words
    listed = page.locator("#apart li")
    expect(listed).to_have_count(2)
    expect(listed.nth(0)).to_contain_text("the chamber's door is open, since ")
    expect(listed.nth(1)).to_contain_text("turntable interlock 1: Open, since ")
    expect(listed.nth(1).locator("time")).to_have_attribute("datetime", "2031-05-06T07:08:09Z")
    expect(page.locator("#log li").first).to_be_visible()
    service.client.post(f"/api/v1/jobs/{job}/cancel")
    expect(page.locator("#state")).to_have_text("cancelled", timeout=20_000)


def test_a_result_says_its_verdict_first_and_its_plots_can_be_zoomed(
    window: Watched, calibrated: list[dict[str, Any]]
) -> None:
    page = window.open(f"/results/{calibrated[0]['result']}")
    assert page.locator(".verdict").evaluate("e => parseFloat(getComputedStyle(e).fontSize)") >= 100
    expect(page.locator(".verdict")).to_contain_text("PASS")
    value = page.locator("table.checks tbody tr").first
    expect(value.locator("canvas.bar")).to_be_visible()
    page.locator("figure[data-figure]").first.scroll_into_view_if_needed()
    plot = page.locator("figure[data-figure] .uplot").first
    expect(plot).to_be_visible()
    with page.expect_download() as taken:
        page.get_by_role("button", name="CSV").first.click()
    assert Path(taken.value.path()).read_text().startswith('"series","x","y","error"')


def test_last_weeks_job_is_found_and_two_calibrations_are_compared(
    window: Watched, calibrated: list[dict[str, Any]]
) -> None:
    page = window.open("/jobs?unit=SIM-0001&verdict=pass")
    expect(page.locator("#found tbody tr").first).to_be_visible()
    page.get_by_label("Text or job number").fill(calibrated[0]["id"][-6:])
    page.get_by_role("button", name="Search").click()
    expect(page.locator("#found tbody tr")).to_have_count(1)
    page.locator("#found a").first.click()
    expect(page).to_have_url(f"{window.address}{calibrated[0]['page']}")
    page.goto(f"{window.address}/units/SIM-0001")
    page.get_by_role("button", name="Show the differences").click()
    expect(page.locator("#difference tbody tr")).to_have_count(12)
    expect(page.locator("#difference")).to_contain_text("b_x")
    page.get_by_role("button", name="Run to run of all").click()
    page.wait_for_url(re.compile("/results/"))


def test_a_recording_is_looked_at_and_a_method_is_run_on_it(window: Watched, calibrated: list[dict[str, Any]]) -> None:
    page = window.open(calibrated[0]["page"])
    page.locator("#recordings a").first.click()
    expect(page.locator("#charts .uplot").first).to_be_visible()
    expect(page.locator("#plot output")).to_contain_text("800 points")
    page.get_by_label("To, s").fill("1")  # at 400 Hz
    page.get_by_role("button", name="Show").click()
    expect(page.locator("#plot output")).to_contain_text("400 points")
    page.get_by_role("link", name="Run a method on it").click()
    expect(page.locator("#chosen")).to_contain_text("1 chosen")
    expect(page.locator("#found input:checked")).to_have_count(1)
    expect(page.locator("#found tbody")).to_contain_text(re.compile(r"#\d+ Calibration in twelve orientations"))
    page.get_by_label("Method").select_option("allan_deviation")
    page.get_by_role("button", name="Run the method").click()
    page.wait_for_url(re.compile("/results/"), timeout=30_000)
    expect(page.get_by_role("heading", level=1)).to_contain_text("Allan deviation")


def test_the_queue_is_ordered_held_and_cancelled(window: Watched, service: BenchProcess) -> None:
    service.client.post("/api/v1/benches/sim/stop", json={"reason": "queue"})
    first, second = (service.submit("no_operation") for _ in range(2))
    page = window.open("/queue")
    expect(page.locator(f'tr[data-job="{first}"]')).to_contain_text("is stopped")
    page.locator(f'tr[data-job="{second}"]').get_by_role("button", name="Move job").click()
    expect(page.locator("tr[data-job]").first).to_have_attribute("data-job", second)
    page.locator(f'tr[data-job="{first}"]').get_by_role("button", name="Cancel").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Your name").fill("Olena")
    dialog.get_by_role("button", name="Cancel the job").click()
    expect(page.locator(f'tr[data-job="{first}"]')).to_have_count(0)
    (stop,) = service.client.get("/api/v1/benches/sim").json()["stops"]
    service.client.post(f"/api/v1/benches/sim/stops/{stop['id']}/release", json={"by": "t", "remark": "t"})
    assert ended(service, second)["state"] == "succeeded"


def test_a_new_unit_is_calibrated_then_verified_in_one_go(window: Watched, service: BenchProcess) -> None:
    page = window.open("/start?unit=SIM-0001&procedure=calibration_12_orientations")
    both = page.get_by_role("button", name="Calibrate, then verify")
    expect(page.locator("#preview")).to_contain_text("12 stations")
    both.click()
    page.wait_for_url(re.compile("/campaign-runs/"))
    expect(page.locator(".verdict")).to_contain_text(re.compile("PASS|FAIL"), timeout=60_000)  # of a new world
    expect(page.locator("tbody tr")).to_have_count(2)


def test_estimates_so_far_are_drawn_while_a_job_runs(window: Watched, service: BenchProcess) -> None:
    """A station may end less than half a second after the one before: the page must look all the same."""
    job = service.submit(parameters={"dwell_s": 5_000.0})
    page = window.open(f"/jobs/{job}")
    expect(page.locator("#estimates")).to_contain_text("Allan deviation so far", timeout=30_000)
    expect(page.locator("#estimates .uplot").first).to_be_visible()
    expect(page.locator("#estimates")).to_contain_text("gyro_x")
    expect(page.locator("#estimates")).to_contain_text("Uncertainty after each station", timeout=80_000)
    service.client.post(f"/api/v1/jobs/{job}/cancel")


def test_the_trail_says_who_did_what(window: Watched, service: BenchProcess) -> None:
    job = service.submit("no_operation")
    service.client.post(f"/api/v1/jobs/{job}/notes", json={"text": "hm"}, headers={"X-Requested-By": "Olena"})
    page = window.open("/audit")
    page.get_by_label("Who", exact=True).fill("Olena")
    page.get_by_role("button", name="Search").click()
    expect(page.locator("#found tbody tr").first).to_contain_text("add_note")
