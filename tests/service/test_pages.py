"""The pages: they answer, are whole, and show progress, verdicts, plots and lineage."""

from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from bench_service.cli.asking.client import connect
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.jobs.reservation import Reservation, Reserved
from bench_service.persistence import open_stores
from bench_service.settings import Settings
from bench_service.wall_clock import new_id, now, pause
from procedures.core.unit import Unit
from tests.service.client import Client
from tests.service.page import page

EVIL = "<script>alert(1)</script>"


@pytest.fixture(scope="module")
def calibrated(sqlite_client: Client) -> dict[str, Any]:
    """A calibration of full length, so that it passes."""
    return sqlite_client.wait(sqlite_client.submit(parameters={}, seed=7)["id"])


def test_the_first_page_says_what_the_bench_has_and_does(sqlite_client: Client, calibrated: dict[str, Any]) -> None:
    home = page(sqlite_client, "/")
    assert "Idle." in home.words
    assert "This bench is a simulation." in home.words
    assert "SIM-0001" in home.words
    assert ("href", f"/jobs/{calibrated['id']}") in home.attributes


def test_the_page_of_a_good_job_has_verdict_coefficients_plots_and_lineage(
    sqlite_client: Client, calibrated: dict[str, Any]
) -> None:
    job = page(sqlite_client, calibrated["page"])
    assert ("class", "badge succeeded") in job.attributes
    assert ("class", "badge pass") in job.attributes
    assert job.tags.count("img") >= 4
    assert "Lineage" in job.words
    assert calibrated["code_version"] in job.words
    for recording in sqlite_client.recordings(calibrated["id"]):
        assert recording["id"] in job.words
    assert "limit of 10 ppm cannot be resolved" in job.words
    assert not any("live.js" in (value or "") for name, value in job.attributes if name == "src")


def test_a_running_job_shows_progress_and_a_way_to_end_it(sqlite_client: Client) -> None:
    running = sqlite_client.submit(parameters={"dwell_s": 86_400.0})
    sqlite_client.wait(running["id"], "running")
    while sqlite_client.http.get("/api/v1/benches/sim").json()["state"] == "idle":
        pause(0.01)
    job, home = page(sqlite_client, running["page"]), page(sqlite_client, "/")
    sqlite_client.http.post(f"/api/v1/jobs/{running['id']}/cancel")
    sqlite_client.wait(running["id"])
    assert {"progress", "button"} <= set(job.tags)
    assert "0 of 12 stations" in " ".join(job.words.split())
    assert "img" not in job.tags
    assert "Busy with" in home.words
    assert "STOP sim" in home.words
    ended = page(sqlite_client, running["page"])
    assert ("class", "badge cancelled") in ended.attributes
    assert ("action", f"/api/v1/jobs/{running['id']}/cancel") not in ended.attributes


def test_a_unit_that_fails_its_limits_is_shown_as_such(sqlite_client: Client) -> None:
    job = sqlite_client.wait(sqlite_client.submit(seed=8)["id"])
    assert job["verdict"] == "fail"
    shown = page(sqlite_client, job["page"])
    assert ("class", "badge fail") in shown.attributes
    result = page(sqlite_client, f"/results/{job['result']}")
    assert ("class", "badge fail") in result.attributes
    assert "img" in result.tags


def test_the_page_of_a_result_is_that_of_its_job_without_the_job(
    sqlite_client: Client, calibrated: dict[str, Any]
) -> None:
    result = page(sqlite_client, f"/results/{calibrated['result']}")
    assert ("class", "badge pass") in result.attributes
    assert ("href", calibrated["page"]) in result.attributes
    assert result.tags.count("img") == page(sqlite_client, calibrated["page"]).tags.count("img")


def test_the_page_of_a_unit_has_its_calibrations_with_uncertainties(
    sqlite_client: Client, calibrated: dict[str, Any]
) -> None:
    unit = page(sqlite_client, "/units/SIM-0001")
    made = sqlite_client.http.get("/api/v1/units/SIM-0001/calibrations").json()["items"]
    assert {c["triad"] for c in made if c["id"] in unit.words} == {"gyro", "accelerometer"}
    assert "±" in unit.words
    assert ("href", f"/results/{calibrated['result']}") in unit.attributes


def test_the_page_of_an_imported_result_has_no_job(sqlite_client: Client) -> None:
    current = sqlite_client.http.get("/api/v1/units/SIM-0001/calibrations").json()["items"]
    if len(current) < 4:
        sqlite_client.wait(sqlite_client.submit(seed=9)["id"])
        current = sqlite_client.http.get("/api/v1/units/SIM-0001/calibrations").json()["items"]
    made = sqlite_client.analyse("run_to_run", calibrations=[c["id"] for c in current[:4]]).json()
    shown = page(sqlite_client, made["page"])
    assert not any((value or "").startswith("/jobs/") for name, value in shown.attributes if name == "href")


def test_a_unit_that_no_bench_has_is_offered_for_analysis_and_not_for_a_job(sqlite_client: Client) -> None:
    channels = [{"name": "gyro_x", "column": 0, "quantity": "angular_rate", "unit": "deg/s"}]
    lines = "".join(f"{0.01 * (k % 7)}\n" for k in range(2000)).encode()
    made = sqlite_client.import_files({"unit": "A-PAPER", "rate_hz": 100.0, "channels": channels}, lines)
    assert made.status_code == 201, made.text
    home = page(sqlite_client, "/")
    links = [value for name, value in home.attributes if name == "href" and value and "unit=" in value]
    assert "/recordings?unit=A-PAPER#run" in links
    assert not any(link.startswith("/start") and "A-PAPER" in link for link in links)
    assert links.index("/start?unit=SIM-0001") < links.index("/recordings?unit=A-PAPER#run")
    for path in ("/units", "/units/A-PAPER"):
        assert not any(
            (value or "").startswith("/start?unit=A-PAPER") for _, value in page(sqlite_client, path).attributes
        )
    result = sqlite_client.analyse("allan_deviation", recordings=[made.json()["id"]]).json()
    shown = page(sqlite_client, result["page"])
    assert "1 file0.csv" in shown.words
    assert page(sqlite_client, f"/recordings/{made.json()['id']}").words.count("file0.csv") == 2  # title and heading


def test_an_address_that_is_markup_comes_back_as_data(sqlite_client: Client) -> None:
    for path in (f"/jobs/{EVIL.replace('/', '%2F')}", "/units/%3Cb%3Ex", "/results/%3Csvg%20onload=alert(1)%3E"):
        answer = sqlite_client.http.get(path)
        assert answer.status_code == 404
        assert answer.headers["content-type"] == "application/problem+json"


def test_the_first_page_lists_some_units_and_says_how_many_there_are_and_who_has_the_bench(tmp_path: Path) -> None:
    """It read and drew a thousand units; those that a bench has stand first."""
    url = f"sqlite:///{tmp_path / 'bench.sqlite'}"
    stores, database = open_stores(url)
    stores.benches.put_bench(SimulatedDriver("sim").description, ["SIM-0001"])
    unit = Unit("A", 200.0, ())
    for serial in (*(f"A-{number:02}" for number in range(25)), "SIM-0001"):
        stores.units.put_unit(replace(unit, serial=serial))
    assert stores.units.serials()[-1] == "SIM-0001"
    begun = now()
    for name, kind in (("SIM-0001", Reserved.UNIT), ("sim", Reserved.BENCH)):
        held = Reservation(new_id(), kind, name, f"<b>Olena</b> {name}", begun, begun + timedelta(hours=2), "drift")
        stores.reservations.add(held)
    assert [one.serial for one in stores.units.units(["SIM-0001", "A-03", "none"])] == ["A-03", "SIM-0001"]
    database.dispose()
    with connect(Settings(database_url=url), None, drive=False) as http:
        home = http.get("/").text
        assert "Reserved for &lt;b&gt;Olena&lt;/b&gt; sim until" in home
        reserved = http.get("/api/v1/benches/sim").json()["reserved"]
        assert (reserved["holder"], reserved["note"]) == ("<b>Olena</b> sim", "drift")
        units = home[home.index("<h2>Units") : home.index("<h2>Latest jobs")]
        assert units.count("<tr><td>") == 20
        assert units.index("SIM-0001") < units.index("A-00")
        assert '<a href="/units">All units: 26</a>' in units
        assert http.get("/units").text.count("<tr><td>") == 26
