"""Enters a stop that came by a stop channel into the database: the stop, the running job, and any delay."""

import logging
from contextlib import suppress

from bench_service.bench.registry import BenchRegistry
from bench_service.bench.stop.exchange import LATE_S
from bench_service.bench.stop.word import StopWord
from bench_service.jobs.queue import QueueStore
from bench_service.jobs.stores import JobStore
from bench_service.model.errors import IllegalTransition, NotUnderstood, ServiceError
from bench_service.model.records import BenchStop
from bench_service.telemetry.audit import AuditEntry, AuditTrail
from bench_service.wall_clock import now

REQUESTS = frozenset({"http", "page"})
"""Ways of a stop for which the audit trail already has an entry, as a request."""

log = logging.getLogger(__name__)


class StopEntry:
    """Enters stops into the database. Repeated for the same stop request it changes nothing."""

    def __init__(self, benches: BenchRegistry, queue: QueueStore, jobs: JobStore, trail: AuditTrail) -> None:
        self._benches = benches
        self._queue = queue
        self._jobs = jobs
        self._trail = trail

    def enter(self, bench_id: str, word: StopWord) -> str | None:
        """Enter a stop; return the running job's id, which is cancelled. Raises `StorageFull`, `StorageFailure`."""
        new = all(stop.id != word.id for stop in self._benches.standing_stops(bench_id))
        self._benches.stop_bench(BenchStop(bench_id, word.at, word.reason, by=word.by, id=word.id))
        running = self._queue.running(bench_id)
        if running is not None:
            with suppress(IllegalTransition, NotUnderstood):  # it has ended this moment; or this version cannot read it
                self._jobs.request_cancel(running.id, now())
        if new:
            self._tell(bench_id, word)
        return None if running is None else running.id

    def _tell(self, bench_id: str, word: StopWord) -> None:
        late_s = (now() - word.at).total_seconds()
        if late_s > LATE_S:
            log.warning("a stop of bench %s is entered %.1f s after it was asked for", bench_id, late_s)
        if late_s <= LATE_S and word.via in REQUESTS:
            return
        text = f"entered {late_s:.1f} s after it was asked for" if late_s > LATE_S else "entered in time"
        detail = {"stop": word.id, "reason": word.reason, "via": word.via, "asked_at": word.at.isoformat()}
        entry = AuditEntry(
            word.id, now(), word.by, "stop", f"bench {bench_id}", "noted", {"text": text, "late_s": late_s, **detail}
        )
        try:
            self._trail.add(entry)  # under the stop's own id: of several processes that enter it, one adds the entry
        except ServiceError as error:
            log.debug("the entry of the trail for stop %s: %s", word.id, error)
