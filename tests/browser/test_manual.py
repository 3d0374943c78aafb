"""Manual mode and mountings with the pages alone: begin, move, refuse, halt by a key, stop, end; enter and take off."""

import re
from collections.abc import Generator
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import AWAY, Watched, process
from tests.end_to_end.bench_process import BenchProcess


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Generator[BenchProcess]:
    made = process(tmp_path_factory.mktemp("manual"), real_time_factor="10")
    made.start()
    yield made
    made.end()


def test_an_operator_moves_the_table_by_hand(
    window: Watched, service: BenchProcess, request: pytest.FixtureRequest
) -> None:
    window.expected = AWAY  # a refusal is an answer of 422, which the browser writes down
    page = window.open("/")
    page.get_by_role("link", name="Manual mode").click()
    page.wait_for_url("**/manual*")
    page.wait_for_selector("html[data-ready]")  # a press before the page's script has come would reload the page
    page.get_by_label("Why").fill("a look at the table")
    page.get_by_role("button", name="Begin manual mode").press("Enter")
    lease = page.locator("#lease")
    expect(lease).to_contain_text("In manual mode by")
    expect(page.locator("#readings")).to_contain_text("outer")
    go = page.locator('form[data-kind="go_to"]')
    expect(go).to_contain_text("-190 … 190 °")
    go.get_by_label("middle").fill("25")
    go.get_by_role("button", name="Go").press("Enter")
    expect(go.locator("output")).to_have_text(re.compile("at rest at 0.0000, 25.0000, 0.0000 deg"))
    expect(page.locator("#readings")).to_contain_text("25.0000")
    supply = page.locator('form[data-kind="supply_on"]')
    supply.get_by_role("button", name="Switch on").click()
    expect(supply.locator("output")).to_contain_text("on: 28.000 V")
    expect(page.locator("#readings")).to_contain_text("gyro_x")
    chamber = page.locator('form[data-kind="chamber"]')
    chamber.get_by_label("Ramp").evaluate("input => { input.removeAttribute('max'); }")  # as another client would
    chamber.get_by_label("Set point").fill("30")
    chamber.get_by_label("Ramp").fill("99")
    chamber.get_by_role("button").click()
    expect(chamber.locator("output.refused")).to_contain_text("ramp_c_min")
    rate = page.locator('form[data-kind="rate"]')
    rate.get_by_label("Rate").fill("5")
    rate.get_by_label("Duration from rest to rest").fill("900")
    rate.get_by_role("button", name="Turn").click()
    expect(page.locator("#readings")).to_contain_text("5.0000")
    pictures: str | None = request.config.getoption("--pictures")
    if pictures:
        page.screenshot(path=Path(pictures) / "manual.png", full_page=True)
    page.keyboard.press("Escape")
    expect(page.locator('form[data-kind="halt"] output')).to_contain_text("the table rests")
    expect(rate.locator("output.refused")).to_contain_text("a halt, a stop or the end of the lease came first")
    expect(page.locator("#made")).to_contain_text("rate_deg_s = 5")
    expect(page.get_by_role("button", name="STOP sim")).to_be_visible()
    page.get_by_role("button", name="End manual mode").click()
    expect(lease).to_contain_text("The bench is not in manual mode.")
    expect(page.locator("#demands")).to_be_hidden()
    service.until(lambda: service.state().safe, 20)


def test_a_stop_on_the_page_ends_manual_mode(window: Watched, service: BenchProcess) -> None:
    page = window.open("/benches/sim/manual")
    page.get_by_label("Why").fill("a look")
    page.get_by_role("button", name="Begin manual mode").click()
    page.locator('form[data-kind="supply_on"]').get_by_role("button").click()
    expect(page.locator('form[data-kind="supply_on"] output')).to_contain_text("on:")
    page.get_by_role("button", name="STOP sim").click()
    expect(page.locator("#lease")).to_contain_text("The last lease ended: the bench was stopped")
    service.until(lambda: service.state().safe, 20)
    service.client.post("/api/v1/benches/sim/release")


def test_a_mounting_is_entered_repeats_and_is_taken_off(
    window: Watched, service: BenchProcess, request: pytest.FixtureRequest
) -> None:
    page = window.open("/mountings")
    for azimuth in ("45.002", "45.004"):
        form = page.locator("#enter")
        form.get_by_label("Plate").fill("A")
        form.get_by_label("Azimuth of the unit's x").fill(azimuth)
        form.get_by_label("Its standard uncertainty").fill("4")
        form.get_by_label("Your name").fill("Olena")
        form.get_by_role("button", name="Enter").click()
        expect(page.locator("#found")).to_contain_text(azimuth)
    # Two readings 0.002 deg = 7.2″ apart have a standard deviation of 7.2/√2 = 5.09″.
    expect(page.locator("#repeats")).to_contain_text("5.09")
    expect(page.locator("#found tr[data-mounting]")).to_have_count(2)
    if pictures := request.config.getoption("--pictures"):
        page.screenshot(path=Path(pictures) / "mountings.png", full_page=True)
    window.expected = re.compile("status of 422")
    page.get_by_role("button", name="From the unit's calibrations").click()
    expect(page.locator("#repeats output")).to_contain_text("calibrations")  # this unit has none yet
    page.get_by_role("button", name="Taken off").click()
    page.get_by_role("dialog").get_by_role("button", name="It was taken off").click()
    expect(page.locator("#found")).not_to_contain_text("Taken off")
