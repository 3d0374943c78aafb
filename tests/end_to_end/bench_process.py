"""The service as an operating system process, for tests that kill it."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import httpx

from bench_service.bench.devices import DeviceState
from bench_service.drivers.device_register import DeviceRegister
from bench_service.model.records import BenchStop
from bench_service.persistence import open_stores
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.wall_clock import monotonic_s, now, pause


class BenchProcess:
    """`bench serve` on a database, with its files in a folder; `settings` are the environment's, without BENCH_."""

    command = (sys.executable, "-m", "bench_service", "serve")

    def __init__(self, database_url: str, port: int, folder: Path, **settings: str) -> None:
        self.environment = {
            **os.environ,
            "BENCH_DATABASE_URL": database_url,
            "BENCH_PORT": str(port),
            "BENCH_DEVICE_FOLDER": str(folder),
            **{f"BENCH_{name.upper()}": value for name, value in settings.items()},
        }
        self.log = folder / "service.log"
        self.register = DeviceRegister(folder, "sim")
        self.files = HostFiles(folder, "sim")
        fresh = httpx.Limits(max_keepalive_connections=0)  # the server ends an idle one just when it is used again
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=30, limits=fresh)

    def start(self) -> None:
        before = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # the suite may run under nohup
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(self.command, env=self.environment, stdout=log, stderr=log)
        signal.signal(signal.SIGHUP, before)
        self.until(self._answers, 90)

    def _answers(self) -> bool:
        assert self.process.poll() is None, self.log.read_text()
        try:
            return self.client.get("/healthz").is_success
        except httpx.TransportError:
            return False

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def terminate(self, number: signal.Signals = signal.SIGTERM) -> float:
        """Ask it to end, which it must do in order; how long that took [s]."""
        begun = monotonic_s()
        self.process.send_signal(number)
        assert self.process.wait(30) == 0, self.log.read_text()
        return monotonic_s() - begun

    def end(self) -> None:
        """End in order what still lives: the service, and a supervisor that it may have left."""
        self.client.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.terminate()
            self.process.wait(60)
        supervisor = self.files.supervisor()
        if supervisor is not None:
            os.kill(supervisor.pid, signal.SIGTERM)
            self.until(lambda: self.files.supervisor() is None, 20)

    def supervised(self) -> None:
        """Wait for the supervisor that the service starts beside itself."""
        self.until(lambda: self.files.supervisor() is not None, 60)

    def submit(self, procedure: str = "calibration_12_orientations", **more: Any) -> str:
        answer = self.client.post("/api/v1/jobs", json={"procedure": procedure, "unit": "SIM-0001", **more})
        assert answer.status_code == 202, answer.text
        return answer.json()["id"]

    def job(self, job_id: str) -> dict[str, Any]:
        return self.client.get(f"/api/v1/jobs/{job_id}").json()

    def station_reached(self, job_id: str, stations: int) -> dict[str, Any]:
        """The job once it has so many stations, or has ended."""
        deadline = monotonic_s() + 90
        while True:
            job = self.job(job_id)
            if job["progress"]["station"] >= stations or job["state"] in ("failed", "cancelled", "succeeded"):
                return job
            assert monotonic_s() < deadline, job
            pause(0.01 if stations <= job["progress"]["stations"] else 0.05)

    def recordings(self, job_id: str) -> list[dict[str, Any]]:
        return self.client.get("/api/v1/recordings", params={"job": job_id}).json()["items"]

    def state(self) -> DeviceState:
        state = self.register.read()
        assert state is not None
        return state

    def moving(self, job_id: str) -> bool:
        found = self.register.read()
        return found is not None and found.table == "moving" and found.job == job_id

    def events(self, job_id: str) -> str:
        """Everything that was said of a job."""
        stores, database = open_stores(self.environment["BENCH_DATABASE_URL"])
        try:
            return "\n".join(str(event.data) for event in stores.jobs.events(job_id))
        finally:
            database.dispose()

    def stop_from_elsewhere(self) -> None:
        """Act of another process that has the database, and is asked to stop the bench."""
        stores, database = open_stores(self.environment["BENCH_DATABASE_URL"])
        try:
            stores.benches.stop_bench(BenchStop("sim", now(), "a test"))
        finally:
            database.dispose()

    @staticmethod
    def until(reached: Any, seconds: float) -> None:
        deadline, look_s = monotonic_s() + seconds, 0.01
        while not reached():
            assert monotonic_s() < deadline, f"not within {seconds} s"
            pause(look_s)
            look_s = min(1.1 * look_s, 0.05)  # a look may take the service's time, which the job shares


def one_master_at_a_time(entries: list[dict[str, Any]]) -> int:
    """Check a devices' journal: between a link's opening and its process's next closing or death nobody else
    commands. How many processes there were.
    """
    masters: list[int] = []
    for entry in entries:
        if entry["verb"] == "link.refused":
            continue
        if entry["verb"] == "link.opened":
            masters.append(entry["pid"])
        assert masters, json.dumps(entry)
        assert entry["pid"] == masters[-1], f"{json.dumps(entry)} while process {masters[-1]} was the master"
    return len(set(masters))
