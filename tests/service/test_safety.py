"""Answers to a stop and a release, over HTTP: with the worker alive, dead, elsewhere; and who sees to the bench."""

from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

import httpx
import pytest

from bench_service.bench import safety
from bench_service.bench.processes import ProcessIdentity
from bench_service.cli.asking.client import connect
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.persistence import open_stores
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.settings import Settings
from bench_service.wall_clock import now
from tests.kit.abandoned_bench import abandoned
from tests.service.client import Client

STOP, RELEASE, BENCH = ("/api/v1/benches/sim/stop", "/api/v1/benches/sim/release", "/api/v1/benches/sim")


@pytest.fixture
def url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'bench.sqlite'}"


@pytest.fixture
def reader(url: str) -> Generator[httpx.Client]:
    """A service that drives nothing, on the bench's host."""
    stores, database = open_stores(url)
    stores.benches.put_bench(SimulatedDriver("sim").description)
    database.dispose()
    with connect(Settings(database_url=url), None, drive=False) as http:
        yield http


def test_a_stop_with_worker_and_supervisor_dead_says_so_and_makes_the_bench_safe(
    reader: httpx.Client, tmp_path: Path
) -> None:
    register = abandoned(tmp_path)
    view = reader.get(BENCH).json()["safety"]
    assert (view["safe"], view["worker"], view["supervisor"]) == (False, None, None)
    assert view["devices"]["unsafe"] == ["the table moves", "the unit is on"]
    assert view["devices"]["by"] == "process 4711 on bench-host"
    said = reader.post(STOP, json={"reason": "smoke"}).json()
    assert "neither a worker nor a supervisor of bench 'sim' is alive" in said["safety"]["explanation"]
    assert "made it safe itself" in said["safety"]["explanation"]
    assert said["safety"]["safe"] is True
    assert "hardware circuit" in said["note"]
    state = register.read()
    assert state is not None
    assert state.safe
    assert reader.get(BENCH).json()["state"] == "stopped"
    assert reader.post(RELEASE).json()["state"] == "idle"


def test_a_release_is_refused_while_another_process_moves_the_table(reader: httpx.Client, tmp_path: Path) -> None:
    register = abandoned(tmp_path)
    link = register.open(by="process 4712 on bench-host")
    said = reader.post(STOP).json()["safety"]
    assert said["safe"] is False
    assert "driven by process 4712 on bench-host" in said["explanation"]
    refused = reader.post(RELEASE)
    assert refused.status_code == 409
    assert refused.json()["type"] == "/problems/NotSafe"
    assert "driven by process 4712" in refused.json()["detail"]
    assert reader.get(BENCH).json()["state"] == "stopped"
    link.close()
    assert reader.post(RELEASE).status_code == 200


def test_of_a_bench_on_another_host_only_that_host_can_say_that_it_is_safe(
    reader: httpx.Client, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(safety, "STOPPING_S", 0.1)
    said = reader.post(STOP).json()["safety"]
    assert (said["safe"], said["devices"]) == (None, None)
    assert "not on this host" in said["explanation"]
    refused = reader.post(RELEASE)
    assert refused.status_code == 409
    assert "no process there has reported that they are safe" in refused.json()["detail"]
    stores, database = open_stores(url)
    stores.benches.confirm_safe("sim", now(), "the supervisor, process 1 on bench-host")
    database.dispose()
    said = reader.get(BENCH).json()["safety"]
    assert said["safe"] is True
    assert "last commanded by the supervisor, process 1 on bench-host" in said["explanation"]
    later = reader.post(STOP, json={"reason": "another"}).json()["stop"]
    assert reader.get(BENCH).json()["safety"]["safe"] is None, "what was seen before the last stop says nothing of it"
    path, body = f"{BENCH}/stops/{later}/release", {"by": "Bo", "remark": "looked"}
    assert reader.post(path, json=body).status_code == 409
    stores, database = open_stores(url)
    stores.benches.confirm_safe("sim", now(), "the supervisor, process 1 on bench-host")
    database.dispose()
    assert reader.post(path, json=body).status_code == 200
    assert reader.post(RELEASE).json()["stopped"] is None


def test_a_stop_over_another_process_reaches_the_worker(url: str) -> None:
    """An API process beside the worker's, on the same database: it has no bench, and the stop holds."""
    settings = Settings(database_url=url, real_time_factor=4.0)
    with connect(settings, None, drive=True) as http, connect(settings, None, drive=False) as beside:
        worker = Client(http)
        job = worker.submit(seed=1)["id"]
        worker.wait(job, "running")
        said = beside.post(STOP, json={"reason": "smoke"}).json()
        assert said["job"] == job
        assert said["safety"]["worker"] == str(ProcessIdentity.own())
        assert worker.wait(job)["state"] == "cancelled"
        assert beside.get(BENCH).json()["safety"]["safe"] is True
        waiting = worker.submit(seed=1)["id"]
        assert worker.job(waiting)["state"] == "queued"
        assert beside.post(RELEASE).status_code == 200
        worker.wait(waiting, "running")
        http.post(f"/api/v1/jobs/{waiting}/cancel")
        worker.wait(waiting)


def test_who_drives_is_told_from_a_later_process_with_the_same_number(tmp_path: Path) -> None:
    files = HostFiles(tmp_path, "sim")
    assert files.driving() is None
    files.begin_driving()
    driving = files.driving()
    assert driving is not None
    assert driving.alive
    own = ProcessIdentity.own()
    assert driving.process == own
    assert not replace(own, started="another boot 1").alive()
    assert not replace(own, host="elsewhere").alive()
    assert not replace(own, started="another boot 1").kill(), "a process that is not meant was killed"
    files.end_driving()
    ended = files.driving()
    assert ended is not None
    assert not ended.alive
    (tmp_path / "bench-sim.driver").write_text("{half")
    assert files.driving() is None
