"""Forms of the console: imports, campaigns and schedules, known calibrations, certificates."""

import json
import re
from datetime import date, timedelta
from pathlib import Path
from urllib.parse import urlencode

import pytest
from playwright.sync_api import Route, expect

from bench_service.formats.certificate.document import certificate
from bench_service.formats.certificate.laboratory import laboratory_of
from bench_service.formats.certificate.signature import new_key, signed
from bench_service.wall_clock import now
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
    doubt = page.locator("#import-doubts label").filter(has=page.get_by_text(re.compile("taken as rad/s")))
    doubt.locator("input").check()
    page.get_by_label("Unit gyro_x").select_option("deg/s")
    expect(page.get_by_label("Unit gyro_y")).to_have_value("deg/s")  # of one triad
    told = page.locator("#import-doubts label").filter(has_text="You chose the units: gyro_x deg/s, gyro_y deg/s")
    expect(told.locator("input")).not_to_be_checked()
    page.get_by_label("Unit gyro_y").select_option("deg/h")
    expect(page.get_by_label("Unit gyro_x")).to_have_value("deg/s")  # given by hand
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


def test_a_unit_that_no_bench_has_cannot_be_started_and_the_page_says_why_once(window: Watched) -> None:
    window.expected = re.compile("status of 422")
    page = window.open("/start?unit=PAPER-9&procedure=calibration_12_orientations")
    expect(page.locator("#nowhere")).to_contain_text("has no unit 'PAPER-9'")
    expect(page.locator("#refusal")).to_contain_text("has no unit 'PAPER-9'")
    expect(page.locator("#cards")).not_to_contain_text("PAPER-9")
    expect(page.get_by_role("button", name="Start", exact=True)).to_be_disabled()
    expect(page.get_by_role("button", name="Calibrate, then verify")).to_be_disabled()
    page.locator("#unit").fill("SIM-0001")
    page.locator("#unit").press("Tab")
    expect(page.get_by_role("button", name="Calibrate, then verify")).to_be_enabled()
    expect(page.locator("#nowhere")).to_be_hidden()
    expect(page.locator("#refusal")).to_be_empty()


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
    page.locator('td[data-campaign="short"]').get_by_role("button", name="Schedule").click()
    page.locator("#campaign").get_by_label("How often").select_option(label="once")
    page.locator("#campaign").get_by_label("Start at", exact=True).fill("2020-01-01T22:30")
    page.locator("#campaign").get_by_role("button", name="Schedule").click()
    expect(page.locator("#campaign output")).to_contain_text("This time has passed")
    tomorrow = (now() + timedelta(days=1)).strftime("%Y-%m-%dT22:30")
    page.locator("#campaign").get_by_label("Start at", exact=True).fill(tomorrow)
    page.locator("#campaign").get_by_role("button", name="Schedule").click()
    expect(page.locator("#schedules tbody tr")).to_have_count(2)
    once = service.client.get("/api/v1/schedules").json()["items"][0]
    assert (once["at"], once["campaign"], once["cron"]) == (once["next_at"], "short", None)
    assert once["at"][:10] in (tomorrow[:10], (now() + timedelta(days=2)).date().isoformat())
    page.locator('td[data-campaign="short"]').get_by_role("button", name="Start").click()
    page.get_by_role("button", name="Start the campaign").click()
    page.wait_for_url(re.compile("/campaign-runs/"))


def test_a_limit_s_own_decision_rule_is_kept_by_the_form(window: Watched, service: BenchProcess) -> None:
    """The form has no field for it: what it does not show, it hands on."""
    limit = {
        "quantity": "gyro.b_x",
        "unit": "deg/h",
        "minimum": -1e6,
        "maximum": 1e6,
        "source": "a test",
        "rule": "guarded",
    }
    step = {"name": "only", "procedure": "calibration_12_orientations", "limits": [limit]}
    made = service.client.post("/api/v1/campaigns", json={"name": "guarded", "title": "Before", "steps": [step]})
    assert made.is_success, made.text
    page = window.open("/campaigns")
    page.locator('td[data-campaign="guarded"]').get_by_role("button", name="Change").click()
    form = page.locator("#campaign form")
    form.get_by_label("Title").fill("After")
    form.get_by_label("Greatest", exact=True).fill("2e6")
    form.get_by_role("button", name="Change the campaign").click()
    expect(page.locator("#campaign form output p").or_(page.get_by_role("cell", name="After")).first).to_be_visible()
    kept = service.client.get("/api/v1/campaigns/guarded").json()["campaign"]
    assert (kept["title"], kept["steps"][0]["limits"]) == ("After", [{**limit, "maximum": 2e6}])


def test_a_batch_is_started_from_a_search_followed_and_asked_for_its_failures(
    window: Watched, service: BenchProcess, calibrated: str
) -> None:
    """Twelve short recordings one by one: those that are too short for the method fail, and their reasons are shown."""
    page = window.open(f"/recordings?job={calibrated}")
    page.locator("#method").select_option("allan_deviation")
    page.locator("#each").select_option("recording")
    page.get_by_role("button", name="Run the method").click()
    expect(page.locator("#refusal")).to_contain_text("The batch is queued")
    batch = page.locator("#batches tr[data-batch]").first
    expect(batch).to_contain_text("12 of 12", timeout=100_000)
    expect(batch).to_contain_text(f"Job {calibrated}")
    expect(batch.locator(".badge")).to_have_text("succeeded")
    batch.get_by_text("Results and failures").click()
    expect(batch.get_by_role("link", name="result")).to_have_count(12)
    page.locator("#each").select_option("")
    page.get_by_role("button", name="Run the method").click()
    expect(page.locator("#refusal")).to_contain_text("Choose recordings in the list above first.")
    page.locator("#each").select_option("job")
    page.locator("#method").select_option("noise_analysis")
    page.get_by_role("button", name="Run the method").click()
    short = page.locator("#batches tr[data-batch]").first
    expect(short).to_contain_text("1 of 1", timeout=100_000)
    expect(short.locator(".badge")).to_have_text("failed")
    short.get_by_text("Results and failures").click()
    expect(short).to_contain_text("too few for a noise analysis")
    expect(short.get_by_role("button", name="Retry")).to_be_visible()


def test_a_batch_takes_what_the_last_search_shows_and_a_job_by_its_number(
    window: Watched, service: BenchProcess, calibrated: str
) -> None:
    number = service.client.get(f"/api/v1/jobs/{calibrated}").json()["number"]
    label = service.client.get(f"/api/v1/recordings?job={number}").json()["items"][0]["station"]["label"]
    few = {"job": str(number), "text": label}
    count = len(service.client.get("/api/v1/recordings", params=few).json()["items"])
    assert 0 < count < 12
    page = window.open(f"/recordings?{urlencode(few)}")
    expect(page.locator("#found tbody tr")).to_have_count(count)
    page.locator("#search [name=text]").fill("nothing has this")  # not searched for
    page.locator("#method").select_option("allan_deviation")
    page.locator("#each").select_option("recording")
    page.get_by_role("button", name="Run the method").click()
    batch = page.locator("#batches tr[data-batch]").first
    expect(batch).to_contain_text(f"{count} of {count}", timeout=100_000)
    expect(batch).to_contain_text(f"Job {calibrated}")


def test_jobs_and_recordings_of_the_last_days_are_found_in_one_go(
    window: Watched, service: BenchProcess, calibrated: str
) -> None:
    """The period fills both days in, and a day that is typed says so. Each job of a recording comes with the list."""
    asked: list[str] = []
    window.context.on("request", lambda request: asked.append(request.url))
    for path, rows in (("/jobs", "#found tbody tr"), ("/recordings", "#found tbody tr")):
        page = window.open(path)
        expect(page.locator(rows).first).to_be_visible()
        page.get_by_label("Period").select_option(label="last 7 days")
        week = (now() - timedelta(days=7)).date()
        assert abs((date.fromisoformat(page.locator("[name=since]").input_value()) - week).days) <= 1
        expect(page.locator(rows).first).to_be_visible()
        page.locator("[name=since]").fill("2020-01-01")
        page.locator("[name=until]").fill("2020-01-31")
        page.get_by_role("button", name="Search").click()
        expect(page.get_by_role("status").filter(has_text="Nothing found.")).to_be_visible()
        assert page.get_by_label("Period").input_value() == "other"
        page.get_by_label("Period").select_option(label="today")
        expect(page.locator(rows).first).to_be_visible()
    number = service.client.get(f"/api/v1/jobs/{calibrated}").json()["number"]
    expect(page.locator(rows).filter(has_text=f"#{number} Calibration").first).to_be_visible()
    assert not [url for url in asked if "/api/v1/jobs/" in url], "a job was asked for by itself"
    page = window.open(f"/jobs?since={(now().astimezone() - timedelta(days=7)).date()}")
    expect(page.get_by_label("Period")).to_have_value(re.compile("7|other"))  # at midnight the browser's day is another


def test_batches_are_followed_past_failed_looks_and_their_button_keeps_the_focus(
    window: Watched, service: BenchProcess, calibrated: str
) -> None:
    """Answers are the test's own: one batch under way, then two looks without an answer, then more of it done."""
    body = {"method": "allan_deviation", "selection": {"job": calibrated}}
    real = service.client.post("/api/v1/analyses", json=body).json()
    looks: list[int] = []

    def answer(route: Route) -> None:
        looks.append(1)
        if len(looks) in (2, 3):
            route.fulfill(status=503, json={"title": "away", "detail": "the database is away"})
            return
        counts = {**dict.fromkeys(real["counts"], 0), "running": 1, "done": len(looks), "waiting": 99 - len(looks)}
        route.fulfill(json={"items": [{**real, "state": "running", "total": 100, "counts": counts}], "next": None})

    window.context.route("**/api/v1/analyses/batches?*", answer)
    window.expected = re.compile("status of 503")
    page = window.open("/recordings")
    cancel = page.locator("#batches").get_by_role("button", name="Cancel")
    cancel.focus()
    expect(page.locator("#batches")).to_contain_text("5 of 100", timeout=20_000)
    expect(cancel).to_be_focused()


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
