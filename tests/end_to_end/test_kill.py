"""``kill -9`` of the real service in orientation 7: the job goes on at 7, and what was recorded stays as it was."""

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from bench_service.wall_clock import pause
from tests.end_to_end.bench_process import BenchProcess

LAUNCH_S = 900.0
"""A launch of 2.3 s at 400 times real time; a part of it is stored every 0.6 s."""


def serving(database_url: str, port: int, folder: Path) -> BenchProcess:
    """A station of about 75 s takes 0.2 s: time to hit one."""
    service = BenchProcess(database_url, port, folder, real_time_factor="400")
    service.start()
    return service


def by_station(service: BenchProcess, job_id: str) -> dict[int, dict[str, Any]]:
    items = service.recordings(job_id)
    assert len({r["station"]["index"] for r in items}) == len(items), "a station is there twice"
    return {r["station"]["index"]: r for r in items}


def samples(service: BenchProcess, recording: dict[str, Any]) -> bytes:
    return service.client.get(f"/api/v1/recordings/{recording['id']}/data", params={"format": "csv"}).content


def begun(database: Path, job_id: str, station: int) -> bool:
    """Whether a part of a station's recording, and no more, is stored."""
    part = "SELECT samples FROM recordings WHERE job_id = ? AND station_index = ? AND state = 'open' AND samples > 0"
    with closing(sqlite3.connect(database)) as connection:
        return connection.execute(part, (job_id, station)).fetchone() is not None


@pytest.mark.timeout(240)
@pytest.mark.parametrize("backend", ["sqlite", "postgres"])
def test_a_job_survives_a_killed_service(
    backend: str, tmp_path: Path, request: pytest.FixtureRequest, free_port: int
) -> None:
    url = f"sqlite:///{tmp_path / 'bench.sqlite'}"
    if backend == "postgres":
        url = request.getfixturevalue("new_postgres_database")()
    service = serving(url, free_port, tmp_path)
    try:
        body = {"procedure": "calibration_12_orientations", "unit": "SIM-0001", "seed": 7}
        undisturbed = service.client.post("/api/v1/jobs", json=body).json()["id"]
        assert service.station_reached(undisturbed, 13)["state"] == "succeeded"
        disturbed = service.client.post("/api/v1/jobs", json=body).json()["id"]
        service.station_reached(disturbed, 6)
        pause(0.1)  # into the seventh orientation
        service.kill()
        service.start()
        before = {k: v for k, v in by_station(service, disturbed).items() if k < 6}
        assert sorted(before) == list(range(6))
        bytes_before = {k: samples(service, r) for k, r in before.items()}
        job = service.station_reached(disturbed, 13)
        assert (job["state"], job["verdict"]) == ("succeeded", "pass"), job
        after = by_station(service, disturbed)
        assert sorted(after) == list(range(12))
        assert {k: after[k]["id"] for k in before} == {k: r["id"] for k, r in before.items()}
        assert {k: samples(service, after[k]) for k in before} == bytes_before
        expected = {k: r["content_hash"] for k, r in by_station(service, undisturbed).items()}
        assert {k: r["content_hash"] for k, r in after.items()} == expected
    finally:
        service.client.close()
        service.terminate()


@pytest.mark.timeout(240)
def test_a_launch_that_is_cut_off_is_kept_and_repeated_whole(tmp_path: Path, free_port: int) -> None:
    """Its continuity is the measurement: half a launch is no launch, and the unit is switched off and on again."""
    service = serving(f"sqlite:///{tmp_path / 'bench.sqlite'}", free_port, tmp_path)
    try:
        parameters = {"launches": 2, "duration_s": LAUNCH_S, "off_time_s": 30.0}
        body = {"procedure": "static_run", "unit": "SIM-0001", "seed": 7, "parameters": parameters}
        undisturbed = service.client.post("/api/v1/jobs", json=body).json()["id"]
        assert service.station_reached(undisturbed, 3)["state"] == "succeeded"
        disturbed = service.client.post("/api/v1/jobs", json=body).json()["id"]
        service.station_reached(disturbed, 1)
        service.until(lambda: begun(tmp_path / "bench.sqlite", disturbed, 1), 60)
        service.kill()
        service.start()
        job = service.station_reached(disturbed, 3)
        assert job["state"] == "succeeded", job
        items = service.recordings(disturbed)
        states = sorted((r["station"]["index"], r["state"], r["count"]) for r in items)
        whole = int(LAUNCH_S) * 400
        assert [s for s in states if s[1] == "complete"] == [(0, "complete", whole), (1, "complete", whole)]
        (cut,) = [s for s in states if s[1] == "interrupted"]
        assert cut[0] == 1
        assert 0 < cut[2] < whole
        complete = {r["station"]["index"]: r for r in items if r["state"] == "complete"}
        expected = {k: r["content_hash"] for k, r in by_station(service, undisturbed).items()}
        assert {k: r["content_hash"] for k, r in complete.items()} == expected
        assert complete[1]["launched_s"] > complete[0]["start_s"] + LAUNCH_S
    finally:
        service.client.close()
        service.terminate()
