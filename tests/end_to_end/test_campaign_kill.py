"""``kill -9`` of the real service in the middle of a campaign: it goes on, and no step is done twice."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from bench_service.wall_clock import monotonic_s, pause

STEPS = [
    {"name": "first", "procedure": "no_operation"},
    {"name": "calibration", "procedure": "calibration_12_orientations", "parameters": {"dwell_s": 20.0}},
    {"name": "last", "procedure": "no_operation"},
]


class Process:
    """The service as an operating system process."""

    def __init__(self, database_url: str, port: int, folder: Path) -> None:
        settings = {"BENCH_DATABASE_URL": database_url, "BENCH_PORT": str(port), "BENCH_REAL_TIME_FACTOR": "200"}
        self.environment = {**os.environ, **settings}
        self.log = folder / "service.log"
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60)
        self.start()

    def start(self) -> None:
        with self.log.open("ab") as log:
            command = [sys.executable, "-m", "bench_service", "serve"]
            self.process = subprocess.Popen(command, env=self.environment, stdout=log, stderr=log)
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

    def run(self, run_id: str) -> dict:
        return self.client.get(f"/api/v1/campaign-runs/{run_id}").json()

    def stations(self, job_id: str) -> int:
        return self.client.get(f"/api/v1/jobs/{job_id}").json()["progress"]["station"]

    def jobs(self) -> list[dict]:
        return self.client.get("/api/v1/jobs", params={"limit": 100}).json()["items"][::-1]


@pytest.mark.timeout(200)
@pytest.mark.parametrize("backend", ["sqlite", "postgres"])
def test_a_campaign_survives_a_killed_service(
    backend: str, tmp_path: Path, request: pytest.FixtureRequest, free_port: int
) -> None:
    url = f"sqlite:///{tmp_path / 'bench.sqlite'}"
    if backend == "postgres":
        url = request.getfixturevalue("new_postgres_database")()
    service = Process(url, free_port, tmp_path)
    try:
        service.client.post("/api/v1/campaigns", json={"name": "night", "steps": STEPS}).raise_for_status()
        run_id = service.client.post("/api/v1/campaigns/night/runs", json={"unit": "SIM-0001", "seed": 3}).json()["id"]
        deadline = monotonic_s() + 120
        killed = False
        while (run := service.run(run_id))["state"] in ("queued", "running"):
            assert monotonic_s() < deadline, run
            step = run["steps"][1]
            if (
                not killed
                and step["job"]
                and service.client.get(f"/api/v1/jobs/{step['job']}").json()["progress"]["station"] >= 3
            ):
                service.kill()
                service.start()
                killed = True
            pause(0.05)
        assert killed
        assert run["state"] == "succeeded", run
        assert [job["id"] for job in service.jobs()] == [step["job"] for step in run["steps"]]
        assert [step["attempt"] for step in run["steps"]] == [1, 1, 1]
        assert {step["verdict"] for step in run["steps"]} <= {"pass", "fail"}
    finally:
        service.client.close()
        service.process.terminate()
        assert service.process.wait(30) in (0, -signal.SIGTERM), service.log.read_text()
