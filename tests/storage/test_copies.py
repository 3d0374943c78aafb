"""Copies of a database and what becomes of them: restored into either database, every row is as it was."""

import sqlite3
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import sqlalchemy as sa

from bench_service.campaigns.stores import Stores
from bench_service.model.errors import BenchBusy, StorageFailure, StorageFull
from bench_service.model.job import Job
from bench_service.model.records import NewRecording, StoredResult
from bench_service.persistence import Database, acquire_lease, open_stores
from bench_service.persistence.tables.every import METADATA
from bench_service.persistence.upkeep.backups import back_up
from bench_service.persistence.upkeep.contents import check_copy
from bench_service.persistence.upkeep.copies import copy_database
from bench_service.persistence.upkeep.restoring import restore_database
from bench_service.telemetry.upkeep import UpkeepKind


@pytest.fixture
def held(
    stores: Stores,
    new_job: Callable[..., Job],
    new_recording: Callable[..., NewRecording],
    new_result: Callable[..., StoredResult],
) -> Stores:
    """Stores that hold a job with events, a recording of several chunks, and a result."""
    job = stores.jobs.add(new_job())
    writer = stores.recordings.open(new_recording(job_id=job.id, station=job.stations[0]))
    writer.write(np.arange(6 * 200_000, dtype=np.int32).reshape(-1, 6))
    recording = writer.seal()
    stores.results.add(new_result(job_id=job.id, recordings=((recording.id, recording.content_hash),)))
    return stores


def _rows(database: Database) -> dict[str, list[tuple[object, ...]]]:
    """Every row of every table but the reports of upkeep, as the service reads it."""
    with database.engine.connect() as connection:
        return {
            table.name: [tuple(row) for row in connection.execute(sa.select(table).order_by(*table.primary_key))]
            for table in METADATA.sorted_tables
            if table.name != "upkeep"
        }


@pytest.mark.parametrize("into", ["sqlite", "postgres"])
def test_a_copy_is_restored_into_either_database_with_every_row(
    into: str, request: pytest.FixtureRequest, held: Stores, database: Database, tmp_path: Path, database_url: str
) -> None:
    copy = tmp_path / "copies" / "copy.sqlite"
    contents = back_up(database_url, copy, "a test")
    assert contents.faults == ()
    assert (contents.rows["jobs"], contents.chunks) == (1, 3)
    report = held.upkeep.last(UpkeepKind.BACKUP)
    assert report is not None
    assert report.good
    url = f"sqlite:///{tmp_path / 'new' / 'bench.sqlite'}" if into == "sqlite" else None
    url = url or request.getfixturevalue("empty_postgres_url")
    (tmp_path / "new").mkdir()
    assert restore_database(copy, url) == []
    stores, restored = open_stores(url)
    assert _rows(restored) == _rows(database)
    (recording,) = stores.recordings.list().items
    assert list(stores.recordings.damage(recording.info.id, 0, recording.info.count)) == []
    restored.dispose()
    if into == "sqlite":
        with pytest.raises(StorageFailure, match="exists already; --replace"):
            restore_database(copy, url)
        aside = restore_database(copy, url, replace=True)
        assert [path.name.split(".before-restore-")[0] for path in aside] == ["bench.sqlite"]
    else:
        with pytest.raises(StorageFailure, match="holds rows already"):
            restore_database(copy, url)


def test_documents_keep_their_spelling(postgres_url: str, empty_postgres_url: str, tmp_path: Path) -> None:
    """A number's spelling is part of what was stored: hashes may be made of a document's text."""
    database = open_stores(postgres_url)[1]
    spelled = '{"b": 1e16, "a": [1.50, -0.0, 1E-3],  "c": null}'
    with database.write_connection() as connection:
        connection.execute(
            sa.text("INSERT INTO units (serial, document, updated_at) VALUES ('U', CAST(:d AS JSON), now())"),
            {"d": spelled},
        )
    database.dispose()
    back_up(postgres_url, tmp_path / "copy", "a test")
    restore_database(tmp_path / "copy", empty_postgres_url)
    _, restored = open_stores(empty_postgres_url)
    with restored.engine.connect() as connection:
        assert connection.scalar(sa.text("SELECT CAST(document AS TEXT) FROM units")) == spelled
    restored.dispose()


def test_damage_in_a_copy_is_found(held: Stores, database: Database, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    copy_database(database, copy)
    with sqlite3.connect(copy) as file:
        file.execute("UPDATE chunks SET payload = substr(payload, 2) WHERE number = 1")
        file.execute("DELETE FROM chunks WHERE number = 2")
    faults = check_copy(copy).faults
    assert len(faults) == 2
    assert "chunk 1 of recording" in faults[0]
    assert "has 2 chunks of 3" in faults[1]


def test_what_is_no_copy_is_refused(tmp_path: Path, empty_sqlite_url: str) -> None:
    (tmp_path / "letter").write_text("Dear laboratory, " * 500)
    sqlite3.connect(tmp_path / "other").executescript("CREATE TABLE t (x); INSERT INTO t VALUES (1);")
    for name in ("letter", "other", "nothing"):
        with pytest.raises(StorageFailure):
            restore_database(tmp_path / name, empty_sqlite_url)
    assert not (tmp_path / "bench.sqlite").exists()


def test_a_database_that_a_process_drives_is_not_replaced(sqlite_url: str, tmp_path: Path) -> None:
    back_up(sqlite_url, tmp_path / "copy", "a test")
    lease = acquire_lease(sqlite_url, "sim")
    with pytest.raises(BenchBusy, match="drives a bench with this database"):
        restore_database(tmp_path / "copy", sqlite_url, replace=True)
    lease.release()
    restore_database(tmp_path / "copy", sqlite_url, replace=True)


def test_a_copy_on_a_full_disk_leaves_no_file(
    sqlite_url: str, small_disk: Path, new_recording: Callable[..., NewRecording]
) -> None:
    stores, database = open_stores(sqlite_url)
    rng = np.random.Generator(np.random.PCG64(1))
    writer = stores.recordings.open(new_recording())
    writer.write(rng.integers(-(2**31), 2**31 - 1, (30 * 1024 * 1024 // 24, 6), dtype=np.int32))
    writer.seal()
    with pytest.raises(StorageFull):
        copy_database(database, small_disk / "copy")
    assert list(small_disk.iterdir()) == []
    database.dispose()
