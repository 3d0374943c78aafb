"""Rows that a supervisor reads and writes, on both databases, and who else sees it."""

import sqlalchemy as sa

from bench_service.campaigns.stores import Stores
from bench_service.model.records import BenchStop
from bench_service.persistence import Database
from bench_service.persistence.bench.safety_books import SqlSafetyBooks
from bench_service.persistence.tables.telemetry import AuditRow
from bench_service.wall_clock import now
from tests.stops import release_all


def test_a_stop_its_confirmation_and_what_was_done(
    database_url: str, stores: Stores, database: Database, new_job
) -> None:
    job = stores.jobs.add(new_job())
    books = SqlSafetyBooks(database_url, "sim")
    assert not books.standing()
    books.confirm_safe("nobody: there is no stop")
    for _ in range(2):
        books.stop("could not be made safe: a test", "the supervisor")
    books.stop("another reason", "the supervisor")
    assert books.standing()
    other = SqlSafetyBooks(database_url, "sim-2")
    assert not other.standing()
    other.close()
    books.confirm_safe("the supervisor")
    books.confirm_safe("somebody later")
    later = BenchStop("sim", now(), "a stop after that")
    stores.benches.stop_bench(later)
    assert [found.safe_by for found in stores.benches.standing_stops("sim")] == [*["the supervisor"] * 2, ""]
    books.confirm_safe("the supervisor, again")
    assert stores.benches.standing_stops("sim")[2].safe_by == "the supervisor, again"
    stores.benches.release_stop("sim", later.id, now(), "Bo", "")
    stop = stores.benches.bench_stop("sim")
    assert stop is not None
    assert (stop.reason, stop.by, stop.safe_by) == ("could not be made safe: a test", *["the supervisor"] * 2)
    assert len(stores.benches.standing_stops("sim")) == 2
    assert stop.safe_at is not None
    books.note("the supervisor", "made safe", job.id)
    books.note("the supervisor", "made safe", "no such job")
    said = stores.jobs.events(job.id)[-1].data
    assert (said["text"], said["by"]) == ("made safe", "the supervisor")
    with database.read() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(AuditRow)) == 2
    release_all(stores.benches, "sim")
    assert not books.standing()
    books.close()
