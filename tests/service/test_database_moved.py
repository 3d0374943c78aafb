"""A database whose files are deleted or replaced under a running service: it says so and acknowledges nothing more."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bench_service.cli.asking.client import connect
from bench_service.drivers.device_register import DeviceRegister
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.kit.busy_machine import BUSY_S
from tests.service.client import Client

SOON_S = BUSY_S
"""Longest time from the deletion to a bench that is safe [s]: a stop is looked for every 0.2 s, and unwinding takes up
to a second; the rest is room for a busy machine."""


@pytest.fixture
def slow_client(tmp_path: Path) -> Iterator[tuple[Client, Path]]:
    """A service whose bench moves in real time, so that a job is under way for minutes, and its folder."""
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}", real_time_factor=1.0)
    with connect(settings, None, drive=True) as http:
        yield Client(http), tmp_path


def test_a_deleted_database_ends_the_running_job_and_refuses_new_ones(slow_client: tuple[Client, Path]) -> None:
    client, folder = slow_client
    before = client.submit("no_operation")
    client.wait(before["id"])
    job = client.submit(parameters={"dwell_s": 60.0})
    register = DeviceRegister(folder, "sim")
    _until(lambda: (state := register.read()) is not None and state.powered)
    moved = [path.rename(path.with_name(f"away-{path.name}")) for path in sorted(folder.glob("bench.sqlite*"))]

    _until(lambda: (state := register.read()) is not None and state.safe)
    ready = client.http.get("/readyz")
    assert ready.status_code == 503
    assert "bench.sqlite was deleted or moved while the service runs" in ready.json()["detail"]
    refused = client.http.post("/api/v1/jobs", json={"procedure": "no_operation", "unit": "SIM-0001"})
    assert refused.status_code == 503
    assert "was deleted or moved" in refused.json()["detail"]
    assert client.http.get("/healthz").status_code == 200

    for path in moved:  # put back: it goes on
        path.rename(path.with_name(path.name.removeprefix("away-")))
    ended = client.wait(job["id"])
    assert (ended["state"], ended["error"]["kind"]) == ("failed", "DatabaseMoved")
    assert client.http.get("/readyz").status_code == 200
    assert client.wait(client.submit("no_operation")["id"])["state"] == "succeeded"
    assert client.job(before["id"])["state"] == "succeeded"


def test_a_replaced_database_is_noticed(slow_client: tuple[Client, Path]) -> None:
    client, folder = slow_client
    client.wait(client.submit("no_operation")["id"])
    (folder / "other").write_bytes((folder / "bench.sqlite").read_bytes())
    (folder / "other").replace(folder / "bench.sqlite")
    refused = client.http.post("/api/v1/jobs", json={"procedure": "no_operation", "unit": "SIM-0001"})
    assert refused.status_code == 503
    assert "was replaced by another file" in refused.json()["detail"]
    assert "was replaced by another file" in client.http.get("/readyz").json()["detail"]


def test_a_deleted_log_is_noticed_before_anything_is_acknowledged(slow_client: tuple[Client, Path]) -> None:
    client, folder = slow_client
    (folder / "bench.sqlite-wal").unlink()
    refused = client.http.post("/api/v1/jobs", json={"procedure": "no_operation", "unit": "SIM-0001"})
    assert refused.status_code == 503
    assert "-wal, was deleted" in refused.json()["detail"]
    assert client.http.get("/readyz").status_code == 503


def _until(true: Callable[[], object]) -> None:
    deadline = monotonic_s() + SOON_S
    while not true():
        assert monotonic_s() < deadline
        pause(0.02)
