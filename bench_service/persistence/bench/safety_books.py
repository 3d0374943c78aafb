"""Database access of a supervisor: it reads the stops of its bench, and writes its own actions.

It needs few tables, and loads nothing else. The database is opened at the first query, so that a supervisor works
even while the database does not answer.
"""

from collections.abc import Iterable

from sqlalchemy import ColumnElement, select

from bench_service import wall_clock
from bench_service.bench.stop.messages import Listening
from bench_service.bench.stop.word import StopWord
from bench_service.jobs.stop_entry import StopEntry
from bench_service.model.errors import NotFound
from bench_service.model.records import BenchStop
from bench_service.persistence.bench.registry_store import SqlBenchRegistry
from bench_service.persistence.bench.stop_addresses import SqlStopAddresses
from bench_service.persistence.database import Database, connect
from bench_service.persistence.jobs.job_store import SqlJobStore
from bench_service.persistence.jobs.queue_store import SqlQueueStore
from bench_service.persistence.tables.bench import BenchStopRow
from bench_service.persistence.telemetry.audit_store import SqlAuditTrail
from bench_service.telemetry.audit import AuditEntry


class SqlSafetyBooks:
    """SQL implementation of `bench_service.bench.supervisor_ports.SafetyBooks` for one bench."""

    def __init__(self, database_url: str, bench_id: str) -> None:
        self._url = database_url
        self._bench_id = bench_id
        self._opened: Database | None = None

    @property
    def _database(self) -> Database:
        """The database; where its file was replaced, the one that is there now: this process outlives a service."""
        if self._opened is not None and self._opened.replaced():
            self.close()
        if self._opened is None:
            self._opened = connect(self._url)
        return self._opened

    def standing(self) -> tuple[BenchStop, ...]:
        return SqlBenchRegistry(self._database).standing_stops(self._bench_id)

    def stored(self, ids: Iterable[str]) -> tuple[BenchStop, ...]:
        return SqlBenchRegistry(self._database).stored_stops(ids)

    def enter(self, word: StopWord) -> None:
        database = self._database
        stores = SqlBenchRegistry(database), SqlQueueStore(database), SqlJobStore(database), SqlAuditTrail(database)
        StopEntry(*stores).enter(self._bench_id, word)

    def say_listening(self, at: Listening) -> None:
        SqlStopAddresses(self._database).say(self._bench_id, at)

    def confirm_safe(self, by: str) -> None:
        if self._stands(BenchStopRow.released_at.is_(None), BenchStopRow.safe_at.is_(None)):
            SqlBenchRegistry(self._database).confirm_safe(self._bench_id, wall_clock.now(), by)

    def stop(self, reason: str, by: str) -> None:
        stop = BenchStop(self._bench_id, wall_clock.now(), reason, by=by)
        SqlBenchRegistry(self._database).stop_bench_once(stop)

    def note(self, by: str, text: str, job: str | None) -> None:
        at = wall_clock.now()
        entry = AuditEntry(
            wall_clock.new_id(), at, by, "make_safe", f"bench {self._bench_id}", "noted", {"text": text, "job": job}
        )
        SqlAuditTrail(self._database).add(entry)
        if job is not None:
            try:
                SqlJobStore(self._database).note(job, "note", at, {"text": text, "by": by})
            except NotFound:
                return

    def _stands(self, *conditions: ColumnElement[bool]) -> bool:
        """Return whether the bench has a stop that meets all conditions."""
        query = select(BenchStopRow.id).where(BenchStopRow.bench == self._bench_id, *conditions).limit(1)
        with self._database.read() as session:
            return session.scalar(query) is not None

    def close(self) -> None:
        """Close the database's connections, if any were opened."""
        opened, self._opened = self._opened, None
        if opened is not None:
            opened.dispose()
