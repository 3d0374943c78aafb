"""Static launches through REST: from raw counts to noise coefficients, and what the unit's record then says."""

import math
from collections.abc import Generator
from math import ceil
from pathlib import Path
from typing import Any

import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from procedures.core.units import ARCSEC, DEG_PER_SQRT_HOUR, MICRO_G
from tests.service.client import Client
from tests.service.page import drawn

LAUNCH = {"launches": 2, "duration_s": 3600.0, "off_time_s": 60.0}
TRUE_Q = {  # tests' own copy of the default unit's truth: thesis Tables 4.1 and 4.2, means of four launches
    "gyro_x": 0.3875 * ARCSEC,
    "gyro_y": 0.2625 * ARCSEC,
    "gyro_z": 0.225 * ARCSEC,
    "accelerometer_x": 11.0 * MICRO_G,
    "accelerometer_y": 10.25 * MICRO_G,
    "accelerometer_z": 10.75 * MICRO_G,
}
TRUE_N = {
    "gyro_x": 0.001425 * DEG_PER_SQRT_HOUR,
    "gyro_y": 0.001125 * DEG_PER_SQRT_HOUR,
    "gyro_z": 0.0006 * DEG_PER_SQRT_HOUR,
}


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[Client]:
    url = f"sqlite:///{Path(tmp_path_factory.mktemp('static')) / 'bench.sqlite'}"
    with connect(Settings(database_url=url), None, drive=True) as http:
        yield Client(http)


@pytest.fixture(scope="module")
def before(client: Client) -> dict[str, Any]:
    """The unit as it was declared."""
    return client.http.get("/api/v1/units/SIM-0001").json()


@pytest.fixture(scope="module")
def job(client: Client, before: dict[str, Any]) -> dict[str, Any]:
    return client.wait(client.submit("static_run", parameters=LAUNCH, seed=11)["id"], seconds=100.0)


@pytest.fixture(scope="module")
def result(client: Client, job: dict[str, Any]) -> dict[str, Any]:
    assert job["state"] == "succeeded", job
    return client.http.get(f"/api/v1/jobs/{job['id']}/result").json()


def test_each_launch_is_a_power_up_of_its_own(client: Client, job: dict[str, Any]) -> None:
    first, second = client.recordings(job["id"])[::-1]
    assert first["launched_s"] == 60.0
    assert 0.0 < first["start_s"] - first["launched_s"] < 2.0  # the table settles
    assert second["launched_s"] == pytest.approx(first["start_s"] + 3600.0 + 60.0)
    assert [r["count"] for r in (first, second)] == [3600 * 400] * 2
    assert first["content_hash"] != second["content_hash"]


def test_what_was_put_in_comes_out_three_ways(result: dict[str, Any]) -> None:
    """Q and N within 4.5 standard uncertainties of the truth: of nine values one in 10⁴ runs fails by chance."""
    assert result["verdict"] == "pass"
    channels = {c["channel"]: c for c in result["document"]["channels"]}
    assert set(channels) == set(TRUE_Q)
    for process, truth in (("quantization", TRUE_Q), ("random_walk", TRUE_N)):
        for name, true in truth.items():
            (found,) = [m for m in channels[name]["means"] if m["process"] == process]
            assert abs(found["mean"] - true) < 4.5 * found["sd"], (name, process, found["mean"] / true)
            assert found["sd"] < 0.2 * true
    for launch in result["document"]["launches"]:
        for channel in launch["channels"]:
            (q,) = [c for c in channel["coefficients"] if c["process"] == "quantization"]
            true = TRUE_Q[channel["channel"]]
            assert q["graphical"]["value"] == pytest.approx(true, rel=0.05)
            assert q["least_squares"]["value"] == pytest.approx(true, rel=0.05)
            assert q["likelihood"]["lower"] < q["likelihood"]["value"] < q["likelihood"]["upper"]


def test_the_unit_learns_its_noise_and_its_dwell(
    client: Client, before: dict[str, Any], result: dict[str, Any]
) -> None:
    unit = client.http.get("/api/v1/units/SIM-0001").json()
    origin = f"result {result['id']}"
    assert before["gyro"]["noise_origin"] != origin
    assert (unit["gyro"]["noise_origin"], unit["accelerometer"]["noise_origin"]) == (origin, origin)
    assert unit["gyro"]["bias_run_to_run_sd"] == before["gyro"]["bias_run_to_run_sd"]
    found = {c["channel"]: {m["process"]: m for m in c["means"]} for c in result["document"]["channels"]}
    for triad in ("gyro", "accelerometer"):
        for number, axis in enumerate("xyz"):
            noise, means = unit[triad]["noise"][number], found[f"{triad}_{axis}"]
            assert unit[triad]["not_observed"][number] == [p for p, m in means.items() if m["mean"] is None]
            for process, of in means.items():
                # A launch that does not show a process leaves it anywhere below its limit: a²/3, never zero.
                each = [v["value"] or v["upper_limit"] / math.sqrt(3.0) for v in of["values"]]
                assert noise[process] == pytest.approx(math.sqrt(sum(e * e for e in each) / len(each)), rel=1e-12)
                assert noise[process] > 0.0
    longest = result["document"]["averaging_time_s"]
    assert unit["averaging_time_s"] == 5.0 * ceil(longest / 5.0)
    preview = client.http.post(
        "/api/v1/procedures/calibration_12_orientations/preview", json={"unit": "SIM-0001"}
    ).json()
    assert {s["record_s"] for s in preview["stations"]} == {unit["averaging_time_s"]}


def test_the_page_shows_tables_and_plots(client: Client, result: dict[str, Any]) -> None:
    page = client.http.get(result["page"]).text
    for title in ("Noise coefficients, launch by launch", "Step by step", "Averaging time", "three ways, launch 2"):
        assert title in page
    assert drawn(client, page) >= 2 * 6
    unit = client.http.get("/units/SIM-0001").text
    assert f"/results/{result['id']}" in unit


def test_steps_can_be_switched_off_on_the_same_recordings(client: Client, job: dict[str, Any]) -> None:
    plain = {"trim": "none", "self_heating": "none", "wavelet": "none", "full_rate": False}
    answer = client.http.post(f"/api/v1/jobs/{job['id']}/analyses", json={"parameters": plain})
    assert answer.status_code == 201, answer.text
    for launch in answer.json()["document"]["launches"]:
        for channel in launch["channels"]:
            assert [s["name"] for s in channel["stages"]] == ["as recorded"]
            assert min(channel["stages"][0]["curve"]["tau_s"]) == 1.0


def test_the_preview_says_what_a_run_will_be_worth(client: Client) -> None:
    preview = client.http.post("/api/v1/procedures/static_run/preview", json={"unit": "SIM-0001"}).json()
    assert preview["duration_s"] == pytest.approx(4 * (6 + 1) * 3600.0)
    assert len(preview["stations"]) == 4
    named = {u["name"]: u["standard_uncertainty"] for u in preview["predicted_uncertainties"]}
    # 4 × 6 h: half a square root of the modes' number, slower than where quantization rules (60 s), is some 5 % of N
    assert 0.005 < named["gyro_x.random_walk"] / TRUE_N["gyro_x"] < 0.05


@pytest.mark.parametrize(
    ("parameters", "field"),
    [({"launches": 0}, "launches"), ({"duration_s": 10}, "duration_s"), ({"trim": "some"}, "trim")],
)
def test_refusals_name_the_field(client: Client, parameters: dict[str, Any], field: str) -> None:
    body = {"procedure": "static_run", "unit": "SIM-0001", "parameters": parameters}
    answer = client.http.post("/api/v1/jobs", json=body)
    assert answer.status_code == 422
    assert field in answer.text
