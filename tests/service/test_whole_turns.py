"""Whole turns through the service: previewed, made, kept with their recordings, compared, refused, and stopped."""

from typing import Any

import numpy as np
import pytest

from bench_service.drivers.registered import RegisteredBench
from bench_service.drivers.simulated import SimulatedDriver
from procedures.bench import Bench
from simulators.world import SimulatedBench
from tests.service.client import Client

PROCEDURE = "scale_factor_whole_turns"
QUICK = {"rates_deg_s": [60.0], "turning_s": 6.0, "settle_s": 0.5, "rest_s": 1.0, "terms": []}
LOOSE = {"scale_factor_3_sigma_ppm": 10.0}
"""Quick turns are coarse: 3σ of some ppm."""


def test_the_preview_of_the_default_plan_promises_a_part_in_a_million(sqlite_client: Client) -> None:
    plan = sqlite_client.preview(PROCEDURE).json()
    predicted = {u["name"]: u["standard_uncertainty"] for u in plan["predicted_uncertainties"]}
    assert all(3e6 * predicted[f"gyro.K{i}{i}"] < 1.0 for i in (1, 2, 3))
    assert plan["warnings"] == plan["violations"] == []
    assert len(plan["stations"]) == 30
    assert plan["duration_s"] < 3 * 600.0
    assert plan["basis"].startswith("whole turns")
    assert {s["turn"]["axis"] for s in plan["stations"]} == {"outer"}
    assert sorted({s["turn"]["turns"] for s in plan["stations"]}) == [-6, -5, -4, -3, -1, 1, 3, 4, 5, 6]


def test_quick_turns_are_warned_of(sqlite_client: Client) -> None:
    (warning,) = sqlite_client.preview(PROCEDURE, **QUICK).json()["warnings"]
    assert warning.startswith("gyro scale factor: 3σ is to be within 1 ppm")


def test_what_the_table_cannot_do_is_refused_and_nothing_is_kept(sqlite_client: Client) -> None:
    before = sqlite_client.stored()
    for parameters, words in (
        ({"rates_deg_s": [70.0, 20.0, 30.0]}, "outer rate of 70 deg/s is above 60"),
        ({"rates_deg_s": [50.0], "ramp_s": 0.1}, "ramps of 750 deg/s^2 are above 100"),
        ({"rates_deg_s": [50.0]}, "cannot be determined"),
    ):
        body = {"procedure": PROCEDURE, "unit": "SIM-0001", "parameters": parameters}
        answer = sqlite_client.http.post("/api/v1/jobs", json=body)
        assert answer.status_code == 422
        assert words in answer.json()["detail"]
    assert sqlite_client.stored() == before


def test_launches_are_told_apart_at_ten_parts_in_a_million(sqlite_client: Client) -> None:
    """Two jobs are two launches; their coefficients are true, and their scatter is resolved as no calibration's is."""
    ids = []
    for seed in (1, 2):
        parameters = {**QUICK, "make_calibration": True, "limits": LOOSE}
        job = sqlite_client.wait(sqlite_client.submit(PROCEDURE, seed=seed, parameters=parameters)["id"])
        assert (job["state"], job["verdict"], job["error"]) == ("succeeded", "pass", None)
        assert_true(sqlite_client, job["id"])
        ids.append(sqlite_client.http.get("/api/v1/units/SIM-0001").json()["gyro_calibration"])
    turns = [r["station"]["turn"] for r in sqlite_client.recordings(job["id"])]
    assert sorted({t["turns"] for t in turns}) == [-1, 1]
    compared = sqlite_client.analyse("run_to_run", calibrations=ids).json()["document"]
    assert not any("scale factor" in w for w in compared["warnings"])
    page = sqlite_client.http.get(f"/jobs/{job['id']}").text
    assert "Scale factor of gyro z over the rates" in page


def assert_true(client: Client, job_id: str) -> None:
    """Every coefficient within 4.5 of its own standard uncertainties: 12 numbers of unit spread."""
    document = client.http.get(f"/api/v1/jobs/{job_id}/result").json()["document"]
    truth = {t["triad"]: t for t in client.http.get(f"/api/v1/jobs/{job_id}/truth").json()["triads"]}["gyro"]
    true = {f"gyro.b_{axis}": b for axis, b in zip("xyz", truth["bias"], strict=True)}
    true |= {f"gyro.K{i}{j}": truth["matrix"][i - 1][j - 1] for i in (1, 2, 3) for j in (1, 2, 3)}
    found = document["gyro"]["coefficients"]
    errors = [(c["estimate"] - true.get(c["name"], 0.0)) / c["standard_uncertainty"] for c in found]
    assert len(errors) == 12
    assert np.abs(errors).max() < 4.5


def test_a_cancel_while_the_table_turns_ends_at_rest(sqlite_client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[SimulatedBench] = []
    open_bench = SimulatedDriver.open

    def watched(driver: SimulatedDriver, *job: Any) -> Bench:
        bench = open_bench(driver, *job)
        assert isinstance(bench, RegisteredBench)
        assert isinstance(bench.inner, SimulatedBench)
        opened.append(bench.inner)
        return bench

    monkeypatch.setattr(SimulatedDriver, "open", watched)
    hours = {"rates_deg_s": [20.0, 40.0, 60.0], "turning_s": 86_400.0}
    job = sqlite_client.submit(PROCEDURE, seed=1, parameters=hours)
    while not opened or abs(opened[0].turntable.read_rates_deg_s()[0]) < 19.0:
        assert sqlite_client.job(job["id"])["state"] in ("queued", "running")
    assert sqlite_client.http.post(f"/api/v1/jobs/{job['id']}/cancel").status_code == 202
    ended = sqlite_client.wait(job["id"])
    assert (ended["state"], ended["verdict"], ended["progress"]["station"]) == ("cancelled", None, 0)
    (bench,) = opened
    assert bench.turntable.locked
    assert np.all(bench.turntable.read_rates_deg_s() == 0.0)
    assert not bench.supply.is_on()
    assert sqlite_client.http.get("/api/v1/benches/sim").json()["state"] == "idle"
