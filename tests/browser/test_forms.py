"""Forms of the console: imports, campaigns and schedules, known calibrations, certificates."""

import json
import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from bench_service.formats.certificate.document import certificate
from bench_service.formats.certificate.laboratory import laboratory_of
from bench_service.formats.certificate.signature import new_key, signed
from tests.browser.conftest import Watched
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.certificate_facts import TEXT
from tests.kit.waiting import ended


@pytest.fixture(scope="module")
def calibrated(service: BenchProcess) -> str:
    return ended(service, service.submit(seed=7, parameters={}))["id"]


def signed_certificate(service: BenchProcess) -> tuple[bytes, bytes]:
    """A certificate of the newest calibration by a job, and the certificate of the key that signed it."""
    items = service.client.get("/api/v1/units/SIM-0001/calibrations").json()["items"]
    newest = next(one["id"] for one in items if one["result"])
    text = service.client.get(f"/api/v1/units/SIM-0001/calibrations/{newest}/export?format=json").text
    pair = new_key("Bench Lab")
    return signed(certificate(json.loads(text), text, laboratory_of(TEXT), "1"), pair), pair.certificate


def test_a_file_is_imported_after_what_it_does_not_say_was_answered(window: Watched, tmp_path: Path) -> None:
    file = tmp_path / "gyro.csv"
    file.write_text("gyro_x,gyro_y\n" + "".join(f"{0.01 * (k % 5)},{0.02 * (k % 3)}\n" for k in range(500)))
    page = window.open("/recordings")
    page.get_by_label("Drop files here").set_input_files(file)
    expect(page.locator("#looked")).to_contain_text("500 rows", timeout=30_000)  # the first import begins a process
    expect(page.locator("#looked")).to_contain_text("no column is recognised for gyro_z")
    go = page.get_by_role("button", name="Import", exact=True)
    expect(go).to_be_disabled()
    page.locator("#import-unit").fill("PAPER-1")
    page.locator("#import-rate").fill("100")
    page.get_by_label("Unit gyro_x").select_option("deg/s")
    page.get_by_role("checkbox", name="Import gyro_y").uncheck()
    for box in page.locator("#import-doubts input").all():
        box.check()
    go.click()
    page.wait_for_url(re.compile("/recordings/"), timeout=20_000)
    expect(page.locator("#main")).to_contain_text("PAPER-1")
    expect(page.locator("#main")).to_contain_text("100 Hz")
    expect(page.locator("#main")).not_to_contain_text("gyro_y")


def test_columns_that_no_name_tells_are_named_by_the_person(window: Watched, tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text("time_s,w_dps\n" + "".join(f"{k / 50},{0.01 * (k % 5)}\n" for k in range(500)))
    page = window.open("/recordings")
    page.get_by_label("Drop files here").set_input_files(file)
    page.locator("#import-unit").fill("PAPER-2")
    expect(page.locator("#import-columns")).to_contain_text("w_dps", timeout=30_000)
    page.locator("#import-time").select_option("time_s")
    page.get_by_role("checkbox", name="Import w_dps").check()
    page.get_by_label("Channel w_dps").fill("gyro_z")
    page.get_by_label("Channel w_dps").press("Tab")
    for box in page.locator("#import-doubts input").all():
        box.check()
    page.get_by_role("button", name="Import", exact=True).click()
    page.wait_for_url(re.compile("/recordings/"), timeout=20_000)
    expect(page.locator("#main")).to_contain_text("gyro_z")
    expect(page.locator("#main")).to_contain_text("50 Hz")


def test_a_campaign_is_made_started_and_scheduled_by_forms(window: Watched, service: BenchProcess) -> None:
    page = window.open("/campaigns")
    page.get_by_role("button", name="New campaign").click()
    form = page.locator("#campaign form")
    form.get_by_label("Name", exact=True).first.fill("short")
    form.get_by_label("Title").fill("Short")
    form.get_by_role("button", name="Remove verify").click()
    first = form.locator("fieldset[data-step]").first
    first.get_by_label("Does").select_option("procedure no_operation")
    form.get_by_role("button", name="Add a step").click()
    second = form.locator("fieldset[data-step]").nth(1)
    second.get_by_label("Does").select_option("procedure calibration_12_orientations")
    second.get_by_text("Parameters", exact=True).click()
    second.get_by_label("Dwell, s", exact=True).fill("5")
    second.get_by_label("Only after these have passed").select_option("calibrate")
    second.get_by_text("Limits of this step").click()
    second.get_by_role("button", name="Add a limit").click()
    for label, value in (("Quantity", "gyro.b_x"), ("Unit", "deg/h"), ("Greatest", "1e6"), ("Source", "a test")):
        second.get_by_label(label, exact=True).fill(value)
    form.get_by_role("button", name="As JSON").click()
    expect(form.get_by_label("The campaign as JSON")).to_have_value(re.compile('"dwell_s": 5'))
    form.get_by_role("button", name="As a form").click()
    form.get_by_role("button", name="Make the campaign").click()
    cell = page.locator('td[data-campaign="short"]')
    expect(cell.or_(form.locator("output p")).first).to_be_visible()
    page.goto(f"{window.address}/campaigns")
    made = service.client.get("/api/v1/campaigns/short").json()["campaign"]
    assert [step["procedure"] for step in made["steps"]] == ["no_operation", "calibration_12_orientations"]
    assert made["steps"][1]["gates"] == [{"step": "calibrate", "verdict": "pass"}]
    assert made["steps"][1]["parameters"] == {"dwell_s": 5.0}
    assert made["steps"][1]["limits"][0]["maximum"] == 1e6
    cell.get_by_role("button", name="Schedule").click()
    page.locator("#campaign").get_by_label("How often").select_option(label="from Monday to Friday")
    page.locator("#campaign").get_by_label("At", exact=True).fill("22:30")
    page.locator("#campaign").get_by_role("button", name="Schedule").click()
    expect(page.locator("#schedules")).to_contain_text("30 22 * * 1-5")
    page.locator("#schedules").get_by_role("button", name="Switch off").click()
    expect(page.locator("#schedules").get_by_role("button", name="Switch on")).to_be_visible()
    page.locator('td[data-campaign="short"]').get_by_role("button", name="Start").click()
    page.get_by_role("button", name="Start the campaign").click()
    page.wait_for_url(re.compile("/campaign-runs/"))


def test_a_known_calibration_is_entered_and_a_remark_added(window: Watched, service: BenchProcess) -> None:
    page = window.open("/units/SIM-0001")
    page.get_by_role("link", name="Enter a calibration").click()
    page.get_by_label("Triad").select_option("accelerometer")
    for row in page.locator("#coefficients tr").all():
        row.locator("input").nth(1).fill("0.001")
    page.get_by_label("Value of b_x").fill("120")
    page.get_by_label("Origin").fill("passport 17")
    page.locator("#enter").get_by_label("Your name").fill("Olena")
    window.expected = re.compile("status of 422")
    page.get_by_label("Value of K11").fill("0")
    page.get_by_label("Value of K12").fill("0")
    page.get_by_role("button", name="Enter it").click()
    expect(page.locator("#enter output")).to_contain_text("Refused (422)", timeout=15_000)
    page.get_by_label("Value of K11").fill("1.001")
    page.get_by_role("button", name="Enter it").click()
    page.wait_for_url(re.compile("/units/SIM-0001$"))
    # A job of an earlier test may give a newer one meanwhile.
    known = service.client.get("/api/v1/units/SIM-0001/calibrations?limit=100").json()["items"]
    (newest,) = (c for c in known if c["method"] == "entered")
    assert (newest["triad"], newest["origin"], newest["current"]) == ("accelerometer", "passport 17", False)
    assert newest["decisions"][0]["by"] == "Olena"
    remark = page.locator('form[action$="/notes"]')
    remark.get_by_label("Remark").fill("connector replaced")
    remark.get_by_role("button").click()
    expect(page.locator("[data-note]").first).to_contain_text("connector replaced")


def test_a_certificate_is_checked(window: Watched, calibrated: str, service: BenchProcess, tmp_path: Path) -> None:
    certificate, laboratory = signed_certificate(service)
    (tmp_path / "c.xml").write_bytes(certificate)
    (tmp_path / "bad.xml").write_bytes(certificate.replace(b"K-2026-001", b"K-2026-002"))
    (tmp_path / "lab.cert.pem").write_bytes(laboratory)
    page = window.open("/certificate")
    page.get_by_label("Certificate, .xml").set_input_files(tmp_path / "c.xml")
    page.get_by_label("Certificate of the laboratory").set_input_files(tmp_path / "lab.cert.pem")
    page.get_by_role("button", name="Check", exact=True).click()
    expect(page.locator(".verdict")).to_contain_text("VALID")
    expect(page.locator(".verdict")).to_contain_text("CN=Bench Lab")
    expect(page.locator("#outcome")).to_contain_text("the same coefficients are stored here")
    page.get_by_label("Certificate, .xml").set_input_files(tmp_path / "bad.xml")
    page.get_by_role("button", name="Check", exact=True).click()
    expect(page.locator(".verdict")).to_contain_text("NOT VALID")
