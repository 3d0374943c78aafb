"""``kill -9`` of the real service in orientation 7: the job goes on at 7, and what was recorded stays as it was."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from bench_service.wall_clock import monotonic_s, pause

ADDRESS = "http://127.0.0.1"


class Process:
    """The service as an operating system process."""

    def __init__(self, database_url: str, port: int, folder: Path) -> None:
        self.environment = {
            **os.environ,
            "BENCH_DATABASE_URL": database_url,
            "BENCH_PORT": str(port),
            "BENCH_DEVICE_FOLDER": str(folder),
            "BENCH_REAL_TIME_FACTOR": "400",  # a station of about 75 s takes 0.2 s: time to hit one
        }
        self.log = folder / "service.log"
        self.client = httpx.Client(base_url=f"{ADDRESS}:{port}", timeout=60)
        self.start()

    def start(self) -> None:
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "bench_service", "serve"], env=self.environment, stdout=log, stderr=log
            )
        deadline = monotonic_s() + 60
        while True:
            assert self.process.poll() is None, self.log.read_text()
            assert monotonic_s() < deadline, self.log.read_text()
            try:
                if self.client.get("/healthz").is_success:
                    return
            except httpx.TransportError:
                pause(0.05)

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def job(self, job_id: str) -> dict:
        return self.client.get(f"/api/v1/jobs/{job_id}").json()

    def until(self, job_id: str, stations: int) -> dict:
        deadline = monotonic_s() + 90
        while True:
            job = self.job(job_id)
            if job["progress"]["station"] >= stations or job["state"] in ("failed", "cancelled", "succeeded"):
                return job
            assert monotonic_s() < deadline, job
            pause(0.005)

    def recordings(self, job_id: str) -> dict[int, dict]:
        items = self.client.get("/api/v1/recordings", params={"job": job_id}).json()["items"]
        assert len({r["station"]["index"] for r in items}) == len(items), "a station is there twice"
        return {r["station"]["index"]: r for r in items}

    def samples(self, recording: dict) -> bytes:
        return self.client.get(f"/api/v1/recordings/{recording['id']}/data", params={"format": "csv"}).content


@pytest.mark.timeout(240)
@pytest.mark.parametrize("backend", ["sqlite", "postgres"])
def test_a_job_survives_a_killed_service(
    backend: str, tmp_path: Path, request: pytest.FixtureRequest, free_port: int
) -> None:
    url = f"sqlite:///{tmp_path / 'bench.sqlite'}"
    if backend == "postgres":
        url = request.getfixturevalue("new_postgres_database")()
    service = Process(url, free_port, tmp_path)
    try:
        body = {"procedure": "calibration_12_orientations", "unit": "SIM-0001", "seed": 7}
        undisturbed = service.client.post("/api/v1/jobs", json=body).json()["id"]
        assert service.until(undisturbed, 13)["state"] == "succeeded"
        disturbed = service.client.post("/api/v1/jobs", json=body).json()["id"]
        service.until(disturbed, 6)
        pause(0.1)  # into the seventh orientation
        service.kill()
        service.start()
        before = {k: v for k, v in service.recordings(disturbed).items() if k < 6}
        assert sorted(before) == list(range(6))
        bytes_before = {k: service.samples(r) for k, r in before.items()}
        job = service.until(disturbed, 13)
        assert (job["state"], job["verdict"]) == ("succeeded", "pass"), job
        after = service.recordings(disturbed)
        assert sorted(after) == list(range(12))
        assert {k: after[k]["id"] for k in before} == {k: r["id"] for k, r in before.items()}
        assert {k: service.samples(after[k]) for k in before} == bytes_before
        expected = {k: r["content_hash"] for k, r in service.recordings(undisturbed).items()}
        assert {k: r["content_hash"] for k, r in after.items()} == expected
    finally:
        service.client.close()
        service.process.terminate()
        assert service.process.wait(30) in (0, -signal.SIGTERM), service.log.read_text()


@pytest.mark.timeout(240)
def test_a_launch_that_is_cut_off_is_kept_and_repeated_whole(tmp_path: Path, free_port: int) -> None:
    """Its continuity is the measurement: half a launch is no launch, and the unit is switched off and on again."""
    service = Process(f"sqlite:///{tmp_path / 'bench.sqlite'}", free_port, tmp_path)
    try:
        parameters = {"launches": 2, "duration_s": 1200.0, "off_time_s": 30.0}
        body = {"procedure": "static_run", "unit": "SIM-0001", "seed": 7, "parameters": parameters}
        undisturbed = service.client.post("/api/v1/jobs", json=body).json()["id"]
        assert service.until(undisturbed, 3)["state"] == "succeeded"
        disturbed = service.client.post("/api/v1/jobs", json=body).json()["id"]
        service.until(disturbed, 1)
        pause(2.0)  # two thirds into the second launch: more than one chunk of it is committed
        service.kill()
        service.start()
        job = service.until(disturbed, 3)
        assert job["state"] == "succeeded", job
        items = service.client.get("/api/v1/recordings", params={"job": disturbed}).json()["items"]
        states = sorted((r["station"]["index"], r["state"], r["count"]) for r in items)
        whole = 1200 * 400
        assert [s for s in states if s[1] == "complete"] == [(0, "complete", whole), (1, "complete", whole)]
        (cut,) = [s for s in states if s[1] == "interrupted"]
        assert cut[0] == 1
        assert 0 < cut[2] < whole
        complete = {r["station"]["index"]: r for r in items if r["state"] == "complete"}
        expected = {k: r["content_hash"] for k, r in service.recordings(undisturbed).items()}
        assert {k: r["content_hash"] for k, r in complete.items()} == expected
        assert complete[1]["launched_s"] > complete[0]["start_s"] + 1200.0
    finally:
        service.client.close()
        service.process.terminate()
        assert service.process.wait(30) in (0, -signal.SIGTERM), service.log.read_text()
