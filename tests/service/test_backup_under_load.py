"""A copy that is made while clients work: nothing that was acknowledged before it began is missing, a job goes on."""

import hashlib
import shutil
from collections.abc import Callable
from pathlib import Path
from threading import Event, Lock, Thread

import pytest

from bench_service.cli.asking.client import connect
from bench_service.persistence import open_stores
from bench_service.persistence.upkeep.backups import back_up
from bench_service.persistence.upkeep.restoring import restore_database
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.service.client import FAST, Client

MOST = 8
"""Jobs and imports that are acknowledged before the copy begins, at the least."""
GYRO = {"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "deg/s"}


class Crowd:
    """Clients that submit jobs and import recordings, and remember what was acknowledged."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._ending = Event()
        self._mutex = Lock()
        self.jobs: list[str] = []
        self.recordings: dict[str, str] = {}
        self._threads = [Thread(target=work, args=(n,)) for n in range(2) for work in (self._submit, self._import)]

    def begin(self) -> None:
        for thread in self._threads:
            thread.start()

    def acknowledged(self) -> tuple[list[str], dict[str, str]]:
        """Ids of jobs, and content hashes of recordings by id, that were acknowledged so far."""
        with self._mutex:
            return self.jobs[:], dict(self.recordings)

    def end(self) -> None:
        self._ending.set()
        for thread in self._threads:
            thread.join()

    def _submit(self, _number: int) -> None:
        while not self._ending.is_set():
            job = self._client.submit("no_operation")["id"]
            with self._mutex:
                self.jobs.append(job)

    def _import(self, number: int) -> None:
        turn = 0
        while not self._ending.is_set():
            turn += 1
            rows = "\n".join(f"{i / 100:.2f},{(i * 7 + turn * 13 + number) % 97}.5" for i in range(500))
            description = {"unit": "IMPORTED-1", "time_column": "t", "channels": [GYRO]}
            answer = self._client.import_files(description, f"t,x\n{rows}\n".encode())
            assert answer.status_code == 201, answer.text
            with self._mutex:
                self.recordings[answer.json()["id"]] = answer.json()["content_hash"]


@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_a_copy_made_under_load_has_everything_acknowledged_and_its_running_job_goes_on(
    kind: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    url: str = request.getfixturevalue(f"{kind}_url")
    devices, copy = tmp_path / "devices", tmp_path / "copies" / "copy"
    settings = Settings(database_url=url, device_folder=devices, real_time_factor=12.0)
    with connect(settings, None, drive=True) as http:
        client = Client(http)
        long_job = client.submit(parameters=FAST, seed=7)["id"]
        _until(lambda: client.job(long_job)["progress"]["station"] >= 2)
        crowd = Crowd(client)
        crowd.begin()
        _until(lambda: all(len(each) >= MOST for each in crowd.acknowledged()))
        jobs, recordings = crowd.acknowledged()
        contents = back_up(url, copy, "a test")
        assert len(crowd.acknowledged()[0]) > len(jobs), "they worked while the copy was made"
        crowd.end()
        digest = _hashes(client, client.wait(long_job)["id"])
    assert contents.faults == ()

    restored = f"sqlite:///{tmp_path / 'restored' / 'bench.sqlite'}"
    (tmp_path / "restored").mkdir()
    if kind == "postgres":
        restored = request.getfixturevalue("empty_postgres_url")
    restore_database(copy, restored)
    stores, database = open_stores(restored)
    assert {job: stores.jobs.get(job).id for job in jobs} == {job: job for job in jobs}
    for recording, content_hash in recordings.items():
        found = stores.recordings.get(recording).info
        assert found.content_hash == content_hash
        assert list(stores.recordings.damage(recording, 0, found.count)) == []
    assert stores.jobs.get(long_job).state.value == "running"
    database.dispose()
    shutil.rmtree(devices)  # another host: nothing but the copy is there
    with connect(
        settings.model_copy(update={"database_url": restored, "real_time_factor": None}), None, drive=True
    ) as http:
        client = Client(http)
        assert client.wait(long_job)["state"] == "succeeded"
        assert _hashes(client, long_job) == digest


def _hashes(client: Client, job: str) -> str:
    """The recordings of a job, by their contents."""
    recordings = sorted(client.recordings(job), key=lambda found: found["station"]["index"])
    assert len(recordings) == 12
    return hashlib.sha256("".join(found["content_hash"] for found in recordings).encode()).hexdigest()


def _until(true: Callable[[], object]) -> None:
    deadline = monotonic_s() + 90
    while not true():
        assert monotonic_s() < deadline
        pause(0.02)
