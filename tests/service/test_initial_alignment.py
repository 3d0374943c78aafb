"""Initial alignment through REST: calibrated, switched off and on, aligned, judged; refused where it cannot be."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bench_service.cli.asking.client import connect
from bench_service.model.quantities import quantities
from bench_service.settings import Settings
from simulators.truth import default_bench, save_bench
from tests.kit.registered import register_bench
from tests.service.campaigns import add, named
from tests.service.client import Client
from tests.service.page import drawn

PLAN = {
    "orientations": [[0, 0, 0], [-75, 5, -8]],
    "repetitions": 2,
    "alignment_s": 60.0,
    "off_time_s": 30.0,
    "settle_s": 0.5,
    "limits": {"heading_sd_max_deg": 0.5},  # short dwells: the service is tested, not the numbers
}


@pytest.fixture(scope="module")
def uncalibrated(sqlite_client: Client) -> str:
    """The answer of a unit that has no calibration yet."""
    return sqlite_client.preview("initial_alignment", **PLAN).text


@pytest.fixture(scope="module")
def calibration(sqlite_client: Client, uncalibrated: str) -> dict[str, str]:
    return sqlite_client.calibrate(seed=21, dwell_s=30.0, settle_s=0.5)


@pytest.fixture(scope="module")
def job(sqlite_client: Client, calibration: dict[str, str]) -> dict[str, Any]:
    return sqlite_client.wait(sqlite_client.submit("initial_alignment", parameters=PLAN, seed=22)["id"], seconds=100.0)


@pytest.fixture(scope="module")
def result(sqlite_client: Client, job: dict[str, Any]) -> dict[str, Any]:
    assert job["state"] == "succeeded", job
    return sqlite_client.http.get(f"/api/v1/jobs/{job['id']}/result").json()


def test_every_alignment_is_a_launch_and_errs_as_predicted(
    sqlite_client: Client, job: dict[str, Any], result: dict[str, Any]
) -> None:
    assert len({r["launched_s"] for r in sqlite_client.recordings(job["id"])}) == 4
    found = result["document"]["alignments"]
    assert [a["launch"] for a in found] == [1, 2, 3, 4]
    for a in found:  # twelve angles within four standard deviations: one in a thousand runs fails by chance
        for error, sd in zip(a["error_deg"], a["expected_sd_deg"], strict=True):
            assert abs(error) < 4 * sd
    assert found[1]["attitude_deg"][0] == pytest.approx(75.0, abs=0.5)  # the outer axis turns against the compass
    assert found[1]["attitude_deg"][1] == pytest.approx(5.0, abs=0.01)
    assert found[1]["attitude_deg"][2] == pytest.approx(-8.0, abs=0.01)
    names = [c["name"] for c in result["document"]["checks"]]
    assert len(names) == 4
    assert set(quantities(result["document"])) == set(names)
    wrong = {"quantity": "heading", "unit": "deg", "maximum": 1.0, "source": "ours"}
    bad = named("bad", {"procedure": "initial_alignment", "parameters": PLAN, "limits": [wrong]})
    assert "heading, expected standard uncertainty" in sqlite_client.http.post("/api/v1/campaigns", json=bad).text
    step = {"procedure": "initial_alignment", "parameters": PLAN}
    add(sqlite_client, named("aligned", step, decision={"false_alarm": 0.003}))
    foreseen = sqlite_client.http.post("/api/v1/campaigns/aligned/preview", json={"unit": "SIM-0001"})
    assert [limit["check"] for limit in foreseen.json()["steps"][0]["limits"]] == names
    strict = named("strict", step, decision={"false_alarm": 0.002})
    refused = sqlite_client.http.post("/api/v1/campaigns", json=strict)
    assert refused.status_code == 422
    assert "at least 0.003" in refused.text, "three tests of significance count, each at 0.001"
    assert result["verdict"] == "pass", result["document"]["checks"]


def test_the_result_rests_on_the_calibration(
    sqlite_client: Client, calibration: dict[str, str], result: dict[str, Any]
) -> None:
    gyro, accelerometer = calibration.values()
    assert result["document"]["basis"] == f"Aligned with calibration {gyro} (gyro), {accelerometer} (accelerometer)"
    assert result["lineage"]["calibrations"] == [gyro, accelerometer]
    page = sqlite_client.http.get(result["page"]).text
    for text in ("Errors found and predicted", "thesis 1.1", "Expected of one alignment, by source"):
        assert text in page
    assert drawn(sqlite_client, page) >= 1


def test_the_preview_predicts_both_ways(sqlite_client: Client, result: dict[str, Any]) -> None:
    preview = sqlite_client.preview("initial_alignment", **PLAN).json()
    named = {u["name"]: u["standard_uncertainty"] for u in preview["predicted_uncertainties"]}
    heading, pitch, roll = (a["expected_sd_deg"] * 3.14159265 / 180 for a in result["document"]["angles"])
    assert named["heading of one alignment"] == pytest.approx(heading, rel=0.01)
    assert named["pitch of one alignment"] == pytest.approx(pitch, rel=0.01)
    assert named["roll of one alignment"] == pytest.approx(roll, rel=0.01)
    thesis = result["document"]["thesis"]["added_deg"] * 3.14159265 / 180
    assert named["heading by thesis 1.1, added"] == pytest.approx(thesis, rel=1e-6)
    assert preview["duration_s"] > 4 * (60.0 + 30.0)


def test_a_unit_without_a_calibration_is_refused(uncalibrated: str, calibration: dict[str, str]) -> None:
    assert "has no calibration of its accelerometer triad to align with" in uncalibrated
    assert calibration


def test_a_pole_and_a_unit_on_end_are_refused(sqlite_client: Client, calibration: dict[str, str]) -> None:
    before = sqlite_client.stored()
    for parameters, field in (
        ({"latitude_deg": 90.0}, "latitude_deg"),
        ({"orientations": [[0, 90, 0]]}, "orientations"),
    ):
        body = {"procedure": "initial_alignment", "unit": "SIM-0001", "parameters": parameters}
        answer = sqlite_client.http.post("/api/v1/jobs", json=body)
        assert answer.status_code == 422
        assert answer.json()["errors"][0]["field"] == field
    assert sqlite_client.stored() == before


def test_a_bench_at_the_pole_is_refused(tmp_path: Path) -> None:
    shipped = default_bench()
    site = replace(shipped.description.site, latitude_deg=90.0)
    pole = replace(
        shipped,
        site=replace(shipped.site, latitude_deg=90.0),
        description=replace(shipped.description, site=site),
    )
    save_bench(pole, tmp_path / "pole.toml")
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}", bench_truth=tmp_path / "pole.toml")
    register_bench(settings)
    with connect(settings, None, drive=False) as http:
        answer = Client(http).preview("initial_alignment")
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["field"] == "latitude_deg"
    assert "shows no north" in error["message"]
