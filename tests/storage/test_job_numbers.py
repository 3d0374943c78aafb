"""Numbers of jobs in the database: rivals get numbers of their own, an upgrade counts the jobs that there are."""

import sqlite3
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import sqlalchemy as sa

from bench_service.campaigns.stores import Stores
from bench_service.model.errors import NotFound
from bench_service.model.job import Job, JobHeading
from bench_service.persistence import open_stores
from tests.storage.migrating import migrated


def test_rivals_get_numbers_of_their_own(stores: Stores, new_job: Callable[..., Job]) -> None:
    with ThreadPoolExecutor(8) as threads:
        made = list(threads.map(lambda _: stores.jobs.add(new_job()), range(24)))
    assert sorted(job.number for job in made) == list(range(1, 25))
    assert stores.jobs.id_of(made[5].number) == made[5].id
    with pytest.raises(NotFound, match="#25"):
        stores.jobs.id_of(25)
    headings = stores.jobs.headings([made[5].id, "none"])
    assert headings == {made[5].id: JobHeading(made[5].number, "static_run")}
    assert stores.jobs.numbers([job.id for job in made]) == {job.id: job.number for job in made}


def test_an_upgrade_counts_the_jobs_that_there_are(tmp_path: Path, new_job: Callable[..., Job]) -> None:
    url = f"sqlite:///{tmp_path / 'bench.sqlite'}"
    stores, database = open_stores(url)
    ids = [stores.jobs.add(new_job()).id for _ in range(3)]
    migrated(database, "0018")
    with sqlite3.connect(tmp_path / "bench.sqlite") as books:
        assert "number" not in {row[1] for row in books.execute("PRAGMA table_info(jobs)")}
        books.execute("UPDATE jobs SET created_at = datetime(created_at, '-1 day') WHERE id = ?", (ids[2],))
    migrated(database, "0019")
    with database.engine.connect() as connection:
        found = {row.id: row.number for row in connection.execute(sa.text("SELECT id, number FROM jobs"))}
    assert found == {ids[2]: 1, ids[0]: 2, ids[1]: 3}
    database.dispose()
