"""A service that lost its bench to another process says that it is not ready, starts nothing, and gets over it."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import pytest
import sqlalchemy as sa

from bench_service.cli.asking.client import connect
from bench_service.persistence.bench.lease import FileLease, lease_key
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.service.client import Client

LOST = "the bench's lease is lost: another process may drive it"
READY_S = 20.0

Another = Generator[Callable[[], object]]
"""How to give the bench back."""


@contextmanager
def a_replaced_lock_file(_url: str, folder: Path) -> Another:
    """Somebody put another lock file in the place of ours, and holds it."""
    other = FileLease(folder / "other.lock", "sim", "process")
    (folder / "other.lock").replace(folder / "bench-sim.lock")
    yield other.release
    other.release()


@contextmanager
def a_terminated_connection(url: str, _folder: Path) -> Another:
    """The server ends our connection while somebody waits for the lock, who has it from then on."""
    key = lease_key("sim")
    ours = (
        "SELECT pid FROM pg_stat_activity WHERE application_name LIKE 'bench sim process pid %' "
        "AND datname = current_database()"
    )
    waits = "SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND NOT granted AND pid = :pid"
    engine = sa.create_engine(url, isolation_level="AUTOCOMMIT", poolclass=sa.NullPool)
    with engine.connect() as admin, engine.connect() as other:
        pids = list(admin.scalars(sa.text(ours)))
        assert len(pids) == 1
        waiting = {"pid": other.scalar(sa.text("SELECT pg_backend_pid()"))}
        taking = Thread(target=lambda: other.execute(sa.text("SELECT pg_advisory_lock(:key)"), {"key": key}))
        taking.start()
        _until(lambda: admin.scalar(sa.text(waits), waiting) == 1)
        assert admin.scalar(sa.text("SELECT pg_terminate_backend(:pid)"), {"pid": pids[0]})
        taking.join(READY_S)
        yield lambda: other.execute(sa.text("SELECT pg_advisory_unlock(:key)"), {"key": key})


@pytest.mark.parametrize(
    ("backend", "taken"), [("sqlite", a_replaced_lock_file), ("postgres", a_terminated_connection)]
)
def test_a_service_whose_lease_is_lost_is_not_ready_until_it_has_it_again(
    backend: str, taken: Callable[[str, Path], Another], request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    url = request.getfixturevalue(f"{backend}_url")
    with connect(Settings(database_url=url, device_folder=tmp_path), None, drive=True) as http:
        client = Client(http)
        assert http.get("/readyz").status_code == 200
        with taken(url, tmp_path) as give_back:
            for _ in range(20):  # it asks for the lease again and again meanwhile
                answer = http.get("/readyz")
                assert answer.status_code == 503, answer.text
                assert answer.json()["detail"] == LOST
                pause(0.02)
            assert http.get("/healthz").status_code == 200, "the process lives, and answers"
            job = client.submit("no_operation")["id"]
            pause(0.5)
            assert client.job(job)["state"] == "queued"
            give_back()
            _until(lambda: http.get("/readyz").status_code == 200)
        assert client.wait(job)["state"] == "succeeded"


def _until(reached: Callable[[], bool]) -> None:
    deadline = monotonic_s() + READY_S
    while not reached():
        assert monotonic_s() < deadline
        pause(0.02)
