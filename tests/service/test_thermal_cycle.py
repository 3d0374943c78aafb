"""A thermal cycle through REST: three runs in the chamber, a verdict, and a correction that the unit then has.

A short cycle: the full one of 3 × 12 h is `tests.benchmarks.thermal_cycle`.
"""

from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.kit.thermal_plan import SHORT, leg
from tests.service.client import ENDED, Client
from tests.service.page import drawn


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[Client]:
    url = f"sqlite:///{Path(tmp_path_factory.mktemp('thermal')) / 'bench.sqlite'}"
    with connect(Settings(database_url=url), None, drive=True) as http:
        yield Client(http)


@pytest.fixture(scope="module")
def job(client: Client) -> dict[str, Any]:
    """Asked now and then only: each answer takes its time from the job."""
    submitted = client.submit("thermal_cycle", parameters=SHORT, seed=11)
    deadline = monotonic_s() + 110.0
    while (job := client.job(submitted["id"]))["state"] not in ENDED:
        assert monotonic_s() < deadline, job["progress"]
        pause(0.3)
    return job


@pytest.fixture(scope="module")
def result(client: Client, job: dict[str, Any]) -> dict[str, Any]:
    assert job["state"] == "succeeded", job
    return client.http.get(f"/api/v1/jobs/{job['id']}/result").json()


def test_each_run_is_a_launch_with_its_temperatures_and_the_chambers(client: Client, job: dict[str, Any]) -> None:
    assert job["state"] == "succeeded", job
    runs = client.recordings(job["id"])[::-1]
    assert [r["station"]["label"] for r in runs] == ["x up", "y up", "z up"]
    for r in runs:
        names = [c["name"] for c in r["channels"]]
        assert names[6:] == [
            *("temperature_case", "temperature_converter"),
            *("temperature_gyro_x", "temperature_gyro_y", "temperature_gyro_z"),
            *("chamber_air", "chamber_set_point"),
        ]
        assert r["rate_hz"] == 1.0
        assert r["count"] < r["station"]["record_s"]
        assert r["start_s"] - r["launched_s"] < 1.0
    ends = [r["start_s"] + r["count"] for r in runs]
    for earlier, later in zip(ends, runs[1:], strict=False):
        assert later["launched_s"] - earlier >= SHORT["power_off_s"]


def test_the_verdict_is_of_soaks_gravity_allan_and_gyros(result: dict[str, Any]) -> None:
    assert result["verdict"] == "pass", [c for c in result["document"]["checks"] if not c["passed"]]
    names = " ".join(c["name"] for c in result["document"]["checks"])
    for part in ("3σ after correction", "|ĝ|", "Allan", "independence of temperature", "random walk"):
        assert part in names
    cycle = result["document"]["cycle"]
    for run in cycle["runs"]:
        assert [g["target_c"] for g in run["legs"]] == [20.0, -20.0, 50.0]
        assert all(abs(g["case_slope_c_min"]) <= 0.3 for g in run["legs"])
    of = {f["form"]: f["magnitude_dynamic_m_s2"] for f in cycle["forms"]}
    assert of["single"] > 10.0 * of["both"]


def test_the_unit_has_the_correction_and_may_be_judged_by_it(client: Client, result: dict[str, Any]) -> None:
    page = client.http.get("/api/v1/units/SIM-0001/corrections", params={"kind": "thermal"}).json()
    assert len(page["items"]) == 1
    assert page["items"][0]["current"]
    again = client.preview("thermal_cycle", correction="current")
    assert again.status_code == 200, again.text


def test_the_page_shows_tables_and_plots(client: Client, result: dict[str, Any]) -> None:
    page = client.http.get(result["page"]).text
    for title in ("3σ before and after", "Ways to correct", "Evidence for each soak", "Gyros against temperature"):
        assert title in page
    assert drawn(client, page) == 3 * 5 + 3 + 1


def test_the_preview_tells_twelve_hours_a_run(client: Client) -> None:
    preview = client.preview("thermal_cycle").json()
    assert preview["duration_s"] == 3 * (12 + 3) * 3600.0
    assert preview["violations"] == []
    assert preview["data_bytes"] == 3 * 12 * 3600 * 100 * 13 * 2
    assert "converter" in " ".join(preview["warnings"])
    beyond = client.preview("thermal_cycle", legs=[leg(20.0), leg(-90.0), leg(60.0)]).json()
    assert len(beyond["violations"]) == 3
    assert "-90 °C is outside" in beyond["violations"][0]


@pytest.mark.parametrize(
    ("parameters", "field"),
    [
        ({"legs": []}, "legs"),
        ({"legs": [leg(20.0), leg(30.0)]}, "legs"),
        ({"legs": [leg(20.0), {**leg(60.0), "ramp_c_min": 0.01}, leg(0.0)]}, "longest_s"),
        ({"legs": [{**leg(20.0), "least_s": 20_000.0}, leg(60.0), leg(0.0)]}, "longest_s"),
        ({"regime": {"release_c_s2": 1e-3}}, "release_c_s2"),
        ({"sample_rate_hz": 0.0}, "sample_rate_hz"),
        ({"correction": "current"}, "correction"),
    ],
)
def test_refusals_name_the_field(client: Client, parameters: dict[str, Any], field: str) -> None:
    body = {"procedure": "thermal_cycle", "unit": "RANDOM-3", "parameters": parameters}
    answer = client.http.post("/api/v1/jobs", json=body)
    assert answer.status_code == 422, answer.text
    assert field in answer.text
