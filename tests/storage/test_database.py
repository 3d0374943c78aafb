"""The database itself: its form, its durability, what a full disk and a killed process leave behind."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event
from uuid import uuid4

import numpy as np
import pytest
import sqlalchemy as sa
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext

from bench_service.campaigns.stores import Stores
from bench_service.evidence.recordings import RecordingWriter
from bench_service.model.errors import StorageFailure, StorageFull
from bench_service.model.job import Job
from bench_service.model.records import NewRecording, RecordingState
from bench_service.persistence import Database, open_stores
from bench_service.persistence.database import connect
from bench_service.persistence.tables.every import METADATA
from bench_service.persistence.tables.evidence import ChunkRow, RecordingRow
from bench_service.wall_clock import now, pause
from procedures.core.recording import RawArray

ROOT = Path(__file__).resolve().parents[2]
MEGABYTE = 1024 * 1024


def _run(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)


def test_the_migrations_end_where_the_tables_are(empty_database_url: str) -> None:
    _, database = open_stores(empty_database_url)
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, METADATA) == []
        for table, unique in (("recordings", 1), ("calibrations", 2)):
            assert len([i for i in sa.inspect(connection).get_indexes(table) if i["unique"]]) == unique
    open_stores(empty_database_url)[1].dispose()
    database.dispose()


def test_processes_that_start_at_once_migrate_once(empty_database_url: str) -> None:
    program = "import sys; from bench_service.persistence import open_stores; open_stores(sys.argv[1])[1].dispose()"
    with ThreadPoolExecutor(2) as starters:
        ended = list(starters.map(lambda _: _run(program, empty_database_url), range(2)))
    assert [(e.returncode, e.stderr) for e in ended] == [(0, "")] * 2


def test_a_database_of_a_later_version_is_refused(database_url: str) -> None:
    database = connect(database_url)
    with database.write_connection() as connection:
        connection.execute(sa.text("UPDATE alembic_version SET version_num = '9999'"))
    with pytest.raises(StorageFailure, match="another version"):
        open_stores(database_url)
    database.dispose()


def test_what_is_no_database_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "letter.sqlite"
    file.write_text("Dear laboratory, " * 500)
    for url in (f"sqlite:///{file}", "sqlite://", "nonsense", f"sqlite:///{file}/below.sqlite"):
        with pytest.raises(StorageFailure):
            open_stores(url)


def test_a_database_closes_once_nobody_reads(database_url: str) -> None:
    database, reading = connect(database_url), Event()

    def read() -> int | None:
        with database.read() as session:
            found = session.scalar(sa.select(sa.literal(7)))
            reading.set()
            pause(0.3)
        return found

    with ThreadPoolExecutor(1) as pool:
        reader = pool.submit(read)
        assert reading.wait(20)
        old = database.engine.pool
        database.dispose()
        assert old.checkedout() == 0
        assert reader.result() == 7


def test_sqlite_survives_a_power_cut_by_its_settings(sqlite_url: str) -> None:
    _, database = open_stores(sqlite_url)
    with database.engine.connect() as connection:
        asked = [
            connection.scalar(sa.text(f"PRAGMA {name}")) for name in ("journal_mode", "synchronous", "foreign_keys")
        ]
    database.dispose()
    assert asked == ["wal", 2, 1]


CRASH = """
import os, signal, sys
import numpy as np
from bench_service.model.records import NewRecording
from bench_service.persistence import open_stores
from procedures.core.recording import Channel, Quantity
stores, _ = open_stores(sys.argv[1])
job = stores.jobs.get(sys.argv[2])
channels = (Channel("gyro_x", Quantity.ANGULAR_RATE, "count"),)
writer = stores.recordings.open(NewRecording("U-1", channels, 400.0, 0.0, True, job_id=job.id, station=job.stations[0]))
writer.write(np.arange(1_200_000, dtype=np.int32).reshape(-1, 1))
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_process_killed_in_mid_recording_leaves_whole_chunks(
    stores: Stores, database_url: str, new_job: Callable[..., Job]
) -> None:
    job = stores.jobs.add(new_job())
    assert _run(CRASH, database_url, job.id).returncode == -signal.SIGKILL
    assert stores.recordings.list().items == ()
    assert stores.recordings.interrupt_open(job.id) == 1
    (kept,) = stores.recordings.list().items
    assert kept.state is RecordingState.INTERRUPTED
    assert kept.info.count in (524_288, 2 * 524_288)  # the second chunk was on its way, or there
    raw = np.concatenate(list(stores.recordings.load(kept.info.id).blocks()))
    np.testing.assert_array_equal(raw[:, 0], np.arange(kept.info.count))


@pytest.fixture
def full_sqlite(small_disk: Path) -> str:
    return f"sqlite:///{small_disk / 'bench.sqlite'}"


@pytest.fixture
def full_postgres(small_disk: Path, postgres_server: str, postgres_template: str) -> Iterator[str]:
    """A database whose files lie on the small disk, while the server's own log does not."""
    if "TEST_DATABASE_URL" in os.environ:
        pytest.skip("the disk of a given server is not ours")
    own = small_disk / "space"
    own.mkdir()
    for folder in (small_disk.parent, small_disk.parent.parent, small_disk):
        folder.chmod(0o755)
    shutil.chown(own, "pgserver")
    name = f"small_{uuid4().hex}"
    admin = sa.create_engine(postgres_server, isolation_level="AUTOCOMMIT", poolclass=sa.NullPool)
    with admin.connect() as connection:
        connection.execute(sa.text(f"CREATE TABLESPACE {name} LOCATION '{own}'"))
        connection.execute(sa.text(f"CREATE DATABASE {name} TEMPLATE {postgres_template} TABLESPACE {name}"))
    yield sa.make_url(postgres_server).set(database=name).render_as_string(hide_password=False)
    with admin.connect() as connection:
        connection.execute(sa.text(f"DROP DATABASE {name} WITH (FORCE)"))
        connection.execute(sa.text(f"DROP TABLESPACE {name}"))


def _noise(megabytes: int) -> RawArray:
    rng = np.random.Generator(np.random.PCG64(1))
    size = (megabytes * MEGABYTE // 24, 6)
    return rng.integers(-(2**31), 2**31 - 1, size, dtype=np.int32, endpoint=True)


@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_a_full_disk_leaves_nothing_half_made(
    request: pytest.FixtureRequest,
    kind: str,
    small_disk: Path,
    new_job: Callable[..., Job],
    new_recording: Callable[..., NewRecording],
) -> None:
    stores, database = open_stores(request.getfixturevalue(f"full_{kind}"))
    job = stores.jobs.add(new_job())
    first = _fill(stores, new_recording(job_id=job.id, station=job.stations[0]), 1)
    ballast = small_disk / "ballast"
    with ballast.open("wb") as file:
        file.write(b"\0" * (shutil.disk_usage(small_disk).free - 5 * MEGABYTE))

    import_ = stores.recordings.open(new_recording())
    with pytest.raises(StorageFull):
        _write(import_, 40)
    with pytest.raises(StorageFailure, match="abandoned"):
        import_.write(_noise(1))
    import_.abandon()
    dwell = stores.recordings.open(new_recording(job_id=job.id, station=job.stations[1]))
    dwell.write(_noise(1))
    with pytest.raises(OSError, match="No space left"):
        _use_up(ballast)
    if kind == "sqlite":  # Postgres has reused what the abandoned import gave back, or not: its own affair
        with pytest.raises(StorageFull):
            dwell.seal()
    assert [r.info for r in stores.recordings.list().items] == [first]
    assert stores.jobs.get(job.id) == job

    ballast.unlink()
    sealed = dwell.seal()
    assert [r.info.id for r in stores.recordings.of_job(job.id)] == [first.id, sealed.id]
    back = np.concatenate(list(stores.recordings.load(sealed.id).blocks()))
    np.testing.assert_array_equal(back, _noise(1))
    stores.recordings.discard_open_imports(now())
    assert _chunks_without_a_seal(database) == 0
    database.dispose()


def _write(writer: RecordingWriter, megabytes: int) -> None:
    for _ in range(megabytes // 2):
        writer.write(_noise(2))


def _use_up(ballast: Path) -> None:
    with ballast.open("ab", buffering=0) as file:
        while True:
            file.write(b"\0" * 4096)


def _fill(stores: Stores, new: NewRecording, megabytes: int) -> object:
    writer = stores.recordings.open(new)
    writer.write(_noise(megabytes))
    return writer.seal()


def _chunks_without_a_seal(database: Database) -> int:
    query = (
        sa.select(sa.func.count())
        .select_from(ChunkRow)
        .join(RecordingRow, RecordingRow.id == ChunkRow.recording_id)
        .where(RecordingRow.state != RecordingState.COMPLETE.value)
    )
    with database.read() as session:
        return session.scalar(query) or 0


def test_a_database_that_may_not_grow_is_full(sqlite_url: str, new_recording: Callable[..., NewRecording]) -> None:
    stores, database = open_stores(sqlite_url)

    def limit(connection: object, _record: object) -> None:
        connection.execute("PRAGMA max_page_count=200")  # pyright: ignore[reportAttributeAccessIssue]

    sa.event.listen(database.engine, "connect", limit)
    database.dispose()
    with pytest.raises(StorageFull, match="the disk is full"):
        _fill(stores, new_recording(), 1)
    assert stores.recordings.list().items == ()
    sa.event.remove(database.engine, "connect", limit)
    database.dispose()
    _fill(stores, new_recording(), 1)
    database.dispose()
