"""What a supervisor reads and writes, on both databases, and who else sees it."""

import sqlalchemy as sa

from bench_service.campaigns.stores import Stores
from bench_service.persistence import Database
from bench_service.persistence.bench.safety_books import SqlSafetyBooks
from bench_service.persistence.tables.telemetry import AuditRow


def test_a_stop_its_confirmation_and_what_was_done(
    database_url: str, stores: Stores, database: Database, new_job
) -> None:
    job = stores.jobs.add(new_job())
    books = SqlSafetyBooks(database_url, "sim")
    assert not books.stopped()
    books.confirm_safe("nobody: there is no stop")
    books.stop("could not be made safe: a test")
    books.stop("another reason")
    assert books.stopped()
    other = SqlSafetyBooks(database_url, "sim-2")
    assert not other.stopped()
    other.close()
    books.confirm_safe("the supervisor")
    books.confirm_safe("somebody later")
    stop = stores.benches.bench_stop("sim")
    assert stop is not None
    assert (stop.reason, stop.safe_by) == ("could not be made safe: a test", "the supervisor")
    assert stop.safe_at is not None
    books.note("the supervisor", "made safe", job.id)
    books.note("the supervisor", "made safe", "no such job")
    said = stores.jobs.events(job.id)[-1].data
    assert (said["text"], said["by"]) == ("made safe", "the supervisor")
    with database.read() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(AuditRow)) == 2
    stores.benches.release_bench("sim")
    assert not books.stopped()
    books.close()
