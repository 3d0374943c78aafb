"""A job at another supply voltage: set, measured beside its recordings, refused beyond the limits, and over with it."""

import pytest

from tests.service.client import FAST, Client


def supplied(client: Client, job: dict) -> list[tuple[float, float | None]]:
    """Measured voltage and the one that its station names, of each recording of a job."""
    return [
        (r["measured"]["supply"]["voltage_v"], r["station"]["supply_voltage_v"]) for r in client.recordings(job["id"])
    ]


def test_a_margin_test_and_a_job_after_it(sqlite_client: Client) -> None:
    orientations = [[0, 0], [90, 0], [0, 90], [90, 90], [180, 0], [0, 180]]
    few = {**FAST, "orientations": orientations, "scalar_check": False}
    low = sqlite_client.wait(sqlite_client.submit(seed=3, parameters={**few, "supply_voltage_v": 24.0})["id"])
    usual = sqlite_client.wait(sqlite_client.submit(seed=3, parameters=few)["id"])
    assert (low["state"], usual["state"]) == ("succeeded", "succeeded")
    assert supplied(sqlite_client, low) == [(pytest.approx(24.0), 24.0)] * 6
    assert supplied(sqlite_client, usual) == [(pytest.approx(28.0), None)] * 6, "the voltage ends with its job"
    assert low["parameters"]["supply_voltage_v"] == 24.0
    assert "supply_voltage_v" not in usual["parameters"], "trends of earlier versions go on"


def test_a_voltage_beyond_the_bench_is_refused_with_the_range(sqlite_client: Client) -> None:
    body = {"procedure": "static_run", "unit": "SIM-0001", "parameters": {"supply_voltage_v": 50.0}}
    answer = sqlite_client.http.post("/api/v1/jobs", json=body)
    assert answer.status_code == 422
    assert "voltage_v = 50 is outside 0 … 36" in answer.text
