"""Databases of every landed form open, with what they held; so do those of the early forms of revision 0004."""

import os
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path
from secrets import token_hex

import numpy as np
import pytest
import sqlalchemy as sa
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.operations import Operations
from alembic.util import load_python_file

from bench_service.model.job import Job
from bench_service.model.records import NewRecording, StoredResult
from bench_service.model.search import Search
from bench_service.persistence import Database, open_stores
from bench_service.persistence.database import connect
from bench_service.persistence.migration import SCRIPTS, newest_revision, upgrade
from bench_service.persistence.tables.every import METADATA
from procedures.core.recording import RawArray

LANDED = tuple(path.name[:4] for path in sorted(SCRIPTS.glob("versions/0*.py")))[:-1]
"""Every revision before the one of today."""
EARLY = Path(__file__).parent / "early_forms"
HELD = ("units", "jobs", "events", "recordings", "chunks", "results", "result_recordings")
"""Tables that every form has; a database of that form held what its columns can hold."""
FORMS = (*LANDED, "011c34e", "6817c92", "3219e54", "011c34e at 0006")
"""Revisions; and 0004 as of the commits that edited it, the first also with what came after it."""

ON_POSTGRES = FORMS if os.environ.get("ALL_FORMS") else ("0001", "0007", LANDED[-1], "011c34e")
"""Each upgrade passes every later revision; `make validate` sets the variable and has every form begin there too."""


def _make(connection: sa.Connection, form: str) -> None:
    """Make the tables of a form, empty."""
    if form[:4].isdigit() and len(form) == 4:
        upgrade(connection, form)
        return
    upgrade(connection, "0003")
    op = Operations(MigrationContext.configure(connection))
    with Operations.context(MigrationContext.configure(connection)):
        load_python_file(str(EARLY), "0004_left_alone.py").upgrade()
    if form in ("6817c92", "3219e54"):  # the edits of these two commits, and not the last one's indexes
        op.add_column("corrections", sa.Column("kind", sa.String(), nullable=False, server_default="thermal"))
        op.drop_index("uq_corrections_current_unit", table_name="corrections")
        current = {"sqlite_where": sa.text("is_current"), "postgresql_where": sa.text("is_current")}
        op.create_index("uq_corrections_current_unit_kind", "corrections", ["unit", "kind"], unique=True, **current)
    if form == "3219e54":
        op.add_column("bench_stops", sa.Column("safe_at", sa.DateTime(timezone=True), nullable=True))
        op.add_column("bench_stops", sa.Column("safe_by", sa.String(), nullable=False, server_default=""))
    connection.execute(sa.text("UPDATE alembic_version SET version_num = '0004'"))
    if form.endswith("0006"):
        upgrade(connection, "0006")


def _fill(connection: sa.Connection, held: Database) -> None:
    """Copy rows of a database of today, as far as the form has columns for them."""
    with held.engine.connect() as source:
        for name in HELD:
            table = METADATA.tables[name]
            there = {column["name"] for column in sa.inspect(connection).get_columns(name)}
            columns = [column for column in table.columns if column.name in there]
            rows = [dict(row) for row in source.execute(sa.select(*columns)).mappings()]
            if rows:
                connection.execute(sa.insert(sa.table(name, *[sa.column(c.name, c.type) for c in columns])), rows)


@pytest.mark.parametrize(
    ("kind", "form"), [*(("sqlite", form) for form in FORMS), *(("postgres", form) for form in ON_POSTGRES)]
)
def test_a_database_of_each_landed_form_is_upgraded_with_what_it_holds(
    request: pytest.FixtureRequest,
    kind: str,
    form: str,
    tmp_path: Path,
    sqlite_template: Path,
    new_job: Callable[..., Job],
    new_recording: Callable[..., NewRecording],
    new_result: Callable[..., StoredResult],
) -> None:
    empty_database_url = request.getfixturevalue(f"empty_{kind}_url")
    today, held = open_stores(f"sqlite:///{shutil.copy(sqlite_template, tmp_path / 'today.sqlite')}")
    job = today.jobs.add(new_job())
    writer = today.recordings.open(new_recording(job_id=job.id, station=job.stations[0]))
    samples = _samples()
    writer.write(samples)
    recording = writer.seal()
    long = [{"name": name} for name in ("Drive_2.csv", "b.csv", *(token_hex(120) for _ in range(62)))]  # no key
    writer = today.recordings.open(new_recording(source={"files": long}))
    writer.write(samples)
    imported = writer.seal()
    result = today.results.add(new_result(job_id=job.id, recordings=((recording.id, recording.content_hash),)))
    early = connect(empty_database_url)
    with early.write_connection() as connection:
        _make(connection, form)
    with early.write_connection() as connection:
        _fill(connection, held)
    early.dispose()
    held.dispose()

    copies = tmp_path / "copies"
    stores, database = open_stores(empty_database_url, copies)
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, METADATA) == []
    assert stores.jobs.get(job.id) == job
    assert stores.recordings.get(recording.id).info == recording
    np.testing.assert_array_equal(np.concatenate(list(stores.recordings.load(recording.id).blocks())), samples)
    assert stores.results.get(result.id).document == result.document
    for text, found in (("drive_2", imported), ("B.CSV", imported), (job.stations[0].label, recording)):
        assert [one.info.id for one in stores.recordings.list(search=Search(text=text)).items] == [found.id]
    database.dispose()
    (copy,) = copies.iterdir()  # of the database as it was
    with sqlite3.connect(copy) as kept:
        assert kept.execute("SELECT version_num FROM alembic_version").fetchone() < (newest_revision(),)
        assert kept.execute("SELECT id, content_hash FROM recordings ORDER BY id").fetchall() == [
            (one.id, one.content_hash) for one in (recording, imported)
        ]
        assert kept.execute("PRAGMA integrity_check").fetchone() == ("ok",)


def test_a_database_of_todays_form_is_opened_without_a_copy(database_url: str, tmp_path: Path) -> None:
    open_stores(database_url, tmp_path / "copies")[1].dispose()
    assert not (tmp_path / "copies").exists()


def _samples() -> RawArray:
    return np.arange(6000, dtype=np.int32).reshape(-1, 6)
