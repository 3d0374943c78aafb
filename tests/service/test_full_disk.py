"""A database that cannot grow: what runs fails in words, the service still answers, and works again with space."""

import shutil
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from tests.service.client import Client

LONG = {"dwell_s": 3600.0, "settle_s": 0.5}
"""A station of sixteen chunks."""
DESCRIPTION = {
    "unit": "FILE-1",
    "channels": [{"name": "gyro_x", "quantity": "angular_rate", "unit": "count"}],
    "rate_hz": 100.0,
}


class Ceiling:
    """Keeps the service's database, but not its job engine's, from growing by more than a few pages."""

    def __init__(self) -> None:
        self.spare_pages: int | None = None

    def apply(self, connection: Any, _record: object, _proxy: object) -> None:
        """On every connection as it leaves its pool: the limit is a connection's own."""
        file = connection.execute("PRAGMA database_list").fetchone()[2]
        if not file.endswith(".sqlite"):
            return
        pages = connection.execute("PRAGMA page_count").fetchone()[0]
        limit = 2**31 if self.spare_pages is None else pages + self.spare_pages
        connection.execute(f"PRAGMA max_page_count={limit}")


@pytest.fixture
def ceiling() -> Generator[Ceiling]:
    made = Ceiling()
    sa.event.listen(sa.pool.Pool, "checkout", made.apply)
    yield made
    sa.event.remove(sa.pool.Pool, "checkout", made.apply)


def listed(client: Client) -> list[tuple[str, str]]:
    items = client.http.get("/api/v1/recordings", params={"limit": 500}).json()["items"]
    return [(r["id"], r["state"]) for r in items]


def noise_file(rows: int) -> bytes:
    rng = np.random.Generator(np.random.PCG64(1))
    return b"gyro_x\n" + b"".join(b"%d\n" % v for v in rng.integers(-(2**31), 2**31, rows))


def assert_it_answers(client: Client, job_id: str, ready: bool = True) -> None:
    for path in ("/healthz", "/metrics", "/", f"/jobs/{job_id}", "/api/v1/jobs", "/api/v1/benches/sim"):
        assert client.http.get(path).status_code == 200, path
    readiness = client.http.get("/readyz")
    assert readiness.status_code == (200 if ready else 503)
    assert ready or "the disk is nearly full" in readiness.json()["detail"]


def test_a_job_that_fills_the_database_fails_in_words_and_the_next_one_succeeds(
    tmp_path: Path, ceiling: Ceiling
) -> None:
    with connect(Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}"), None, drive=True) as http:
        client = Client(http)
        client.wait(client.submit(seed=1)["id"])
        before = listed(client)
        job = client.submit(parameters=LONG, seed=2)
        client.wait(job["id"], "running")
        ceiling.spare_pages = 3  # a chunk needs more, a line about it does not
        job = client.wait(job["id"])
        assert (job["state"], job["verdict"], job["error"]["kind"]) == ("failed", "error", "StorageFull")
        assert job["error"]["message"] == "the database cannot grow: the disk is full"
        assert job["error"]["station"] == job["progress"]["station"]
        assert_it_answers(client, job["id"])
        assert "the disk is full" in http.get(f"/jobs/{job['id']}").text
        assert http.get("/api/v1/benches/sim").json()["state"] == "idle"
        new = [state for found, state in listed(client) if found not in dict(before)]
        assert new.count("complete") == job["progress"]["station"]
        assert set(new) <= {"complete", "interrupted"}
        refused = client.import_files(DESCRIPTION, noise_file(20_000))
        assert refused.status_code == 507
        assert refused.json()["type"] == "/problems/StorageFull"
        assert len(listed(client)) == len(before) + len(new)
        ceiling.spare_pages = None
        assert client.import_files(DESCRIPTION, noise_file(20_000)).status_code == 201
        assert client.wait(client.submit(seed=3)["id"])["state"] == "succeeded"


@pytest.fixture
def choke(small_disk: Path) -> Generator[Callable[[], None]]:
    """Uses up the last byte of the small disk; the bytes are given back at the end."""
    ballast = small_disk / "ballast"

    def use_up() -> None:
        with ballast.open("ab", buffering=0) as file:
            file.write(b"\0" * shutil.disk_usage(small_disk).free)

    yield use_up
    ballast.unlink(missing_ok=True)


def test_a_full_disk_takes_no_new_job_and_gives_what_there_is(small_disk: Path, choke: Callable[[], None]) -> None:
    with connect(Settings(database_url=f"sqlite:///{small_disk / 'bench.sqlite'}"), None, drive=True) as http:
        client = Client(http)
        done = client.wait(client.submit(seed=1)["id"])
        before = client.stored()
        choke()
        body = {"procedure": "no_operation", "unit": "SIM-0001"}
        full = http.post("/api/v1/jobs", json=body)
        while full.status_code == 202:  # pages that the database has in reserve take a few more jobs
            full = http.post("/api/v1/jobs", json=body)
        assert (full.status_code, full.json()["detail"]) == (507, "the database cannot grow: the disk is full")
        assert_it_answers(client, done["id"], ready=False)
        first = client.recordings(done["id"])[0]["id"]
        assert len(http.get(f"/api/v1/recordings/{first}/data", params={"format": "csv"}).text) > 10_000
        assert client.stored()["recordings"] == before["recordings"]
        (small_disk / "ballast").unlink()
        assert client.wait(client.submit(seed=3)["id"])["state"] == "succeeded"


def test_a_job_whose_failure_cannot_be_written_ends_once_there_is_space(
    small_disk: Path, choke: Callable[[], None]
) -> None:
    with connect(Settings(database_url=f"sqlite:///{small_disk / 'bench.sqlite'}"), None, drive=True) as http:
        client = Client(http)
        job = client.submit(parameters=LONG, seed=2)
        while client.job(job["id"])["progress"]["station"] == 0:
            pass
        choke()
        while http.get("/api/v1/benches/sim").json()["state"] == "busy":
            pass
        assert_it_answers(client, job["id"], ready=False)
        (small_disk / "ballast").unlink()
        ended = client.wait(job["id"])
        assert (ended["state"], ended["error"]["kind"]) == ("failed", "StorageFull")
        assert client.wait(client.submit(seed=3)["id"])["state"] == "succeeded"


def test_a_job_that_a_full_disk_left_open_goes_on_after_a_restart(small_disk: Path, choke: Callable[[], None]) -> None:
    settings = Settings(database_url=f"sqlite:///{small_disk / 'bench.sqlite'}")
    with connect(settings, None, drive=True) as http:
        client = Client(http)
        job = client.submit(parameters={"dwell_s": 300.0}, seed=2)
        while client.job(job["id"])["progress"]["station"] == 0:
            pass
        choke()
        while http.get("/api/v1/benches/sim").json()["state"] == "busy":
            pass
        state = client.job(job["id"])["state"]
        assert state in ("running", "failed")
    (small_disk / "ballast").unlink()
    with connect(settings, None, drive=True) as http:
        client = Client(http)
        ended = client.wait(job["id"])
        assert ended["state"] == ("succeeded" if state == "running" else "failed")
        complete = [r["station"]["index"] for r in client.recordings(job["id"]) if r["state"] == "complete"]
        assert len(set(complete)) == len(complete)
        assert len(complete) == ended["progress"]["station"]
        assert client.wait(client.submit(seed=3)["id"])["state"] == "succeeded"
