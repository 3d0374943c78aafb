"""Faults of the bench: tried again from the station that failed, as often as was asked for; then left to a person."""

import json
from collections.abc import Generator
from pathlib import Path

import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from tests.service.client import FAST, Client

FAULTS = {"seed": 1, "rules": [{"verb": "turntable.move_to", "kind": "disconnect", "probability": 0.5}]}
"""Of twelve moves none fails in one run of 4096."""


@pytest.fixture
def database(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'bench.sqlite'}"


@pytest.fixture
def faulty(database: str) -> Generator[Client]:
    """A bench whose table does not answer every second time; pauses before a retry last a thousandth."""
    settings = Settings(database_url=database, device_faults=json.dumps(FAULTS), retry_scale=0.001)
    with connect(settings, None, drive=True) as http:
        yield Client(http)


def events(client: Client, job: str) -> list[dict]:
    lines = client.http.get(f"/api/v1/jobs/{job}/events").text.splitlines()
    return [json.loads(line.removeprefix("data: "))["data"] for line in lines if line.startswith("data: ")]


def hashes(client: Client, job: str) -> list[str]:
    found = [r for r in client.recordings(job) if r["state"] == "complete"]
    return [r["content_hash"] for r in sorted(found, key=lambda r: r["station"]["index"])]


def test_a_fault_is_tried_again_then_left_to_a_person_and_nothing_is_lost(faulty: Client) -> None:
    job = faulty.submit(seed=5, parameters=FAST, retries=3)
    assert (job["retries"], job["retries_left"]) == (3, 3)
    done, resumed = faulty.wait(job["id"]), 0
    while done["state"] == "failed":
        assert (done["error"]["kind"], done["resumable"], done["retries_left"]) == ("Disconnected", True, 0)
        assert resumed < 30
        again = faulty.http.post(f"/api/v1/jobs/{job['id']}/resume")
        assert again.status_code == 202, again.text
        assert again.json()["retries_left"] == 3
        done, resumed = faulty.wait(job["id"]), resumed + 1
    assert done["state"] == "succeeded"
    assert not done["resumable"]
    tries = [e for e in events(faulty, job["id"]) if "again_because" in e]
    assert len(tries) == 3 * resumed + 3 - done["retries_left"] > 0
    assert {e["again_because"]["kind"] for e in tries} == {"Disconnected"}
    assert done["attempt"] == 1 + len(tries) + resumed
    late = faulty.http.post(f"/api/v1/jobs/{job['id']}/resume")
    assert late.status_code == 409
    assert "succeeded" in late.json()["detail"]
    undisturbed = faulty.submit(seed=5, parameters=FAST, retries=5)
    while faulty.wait(undisturbed["id"])["state"] == "failed":  # another way through the faults, the same bytes
        faulty.http.post(f"/api/v1/jobs/{undisturbed['id']}/resume")
    assert hashes(faulty, job["id"]) == hashes(faulty, undisturbed["id"])
    assert len(hashes(faulty, job["id"])) == 12


def test_without_retries_a_fault_ends_the_job(faulty: Client) -> None:
    job = faulty.wait(faulty.submit(seed=5, parameters=FAST)["id"])
    assert (job["state"], job["error"]["kind"], job["attempt"]) == ("failed", "Disconnected", 1)
    for number in (-1, 6):
        body = {"procedure": "no_operation", "unit": "SIM-0001", "retries": number}
        refusal = faulty.http.post("/api/v1/jobs", json=body)
        assert refusal.status_code == 422
        assert refusal.json()["errors"][0]["field"] == "retries"
