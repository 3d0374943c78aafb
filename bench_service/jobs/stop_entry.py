"""Enters a stop that came by a stop channel into the database: the stop, the running job, and any delay."""

import logging
from contextlib import suppress

from bench_service.bench.registry import BenchRegistry
from bench_service.bench.stop.exchange import LATE_S
from bench_service.bench.stop.word import StopWord
from bench_service.jobs.queue import QueueStore
from bench_service.jobs.stores import JobStore
from bench_service.model.errors import IllegalTransition, NotUnderstood
from bench_service.model.records import BenchStop
from bench_service.telemetry.audit import AuditEntry, AuditTrail
from bench_service.wall_clock import now

REQUESTS = frozenset({"http", "page"})
"""Ways of a stop for which the audit trail already has an entry, as a request."""

_FROM_FOLDER = "restored from the bench's device folder"
RESTORED = f"not in the database: {_FROM_FOLDER}"
"""Remark in the reason and in the audit trail of a stop that a restored database did not know."""

log = logging.getLogger(__name__)


class StopEntry:
    """Enters a stop of the stop channel into the database: the stop, the cancellation of the running job, an audit
    entry.

    Several processes enter the same stop, and each repeats it from the beginning where the database fails in between.
    So each part changes nothing where it was done before, and none is left out because an earlier one was done.
    """

    def __init__(self, benches: BenchRegistry, queue: QueueStore, jobs: JobStore, trail: AuditTrail) -> None:
        self._benches = benches
        self._queue = queue
        self._jobs = jobs
        self._trail = trail

    def enter(self, bench_id: str, word: StopWord) -> str | None:
        """Enter a stop, cancel the bench's running job, and return that job's id; None where none ran. Raises
        `StorageFull`, `StorageFailure`.

        A stop that was released before the entry is complete ends no job: the one that runs by then began after it.
        """
        marked = _FROM_FOLDER in word.reason  # also in the words of an older version, which began otherwise
        reason = f"{word.reason} ({RESTORED})" if word.restored and not marked else word.reason
        stop = self._benches.stop_bench(BenchStop(bench_id, word.at, reason, by=word.by, id=word.id))
        running = self._queue.running(bench_id) if stop.stands else None
        if running is not None:
            with suppress(IllegalTransition, NotUnderstood):  # it has ended this moment; or this version cannot read it
                self._jobs.request_cancel(running.id, now(), word.by, f"stop of bench {bench_id}: {reason}")
        self._note(word, stop)
        return None if running is None else running.id

    def _note(self, word: StopWord, stop: BenchStop) -> None:
        """Add an audit entry for a stop that no request's entry covers, or that reached the database late or by
        restoration.
        """
        late_s = ((stop.entered_at or word.at) - word.at).total_seconds()
        if late_s <= LATE_S and word.via in REQUESTS and not word.restored:
            return
        text = f"entered {late_s:.1f} s after it was asked for" if late_s > LATE_S else "entered in time"
        if word.restored:
            text = f"{RESTORED}, {late_s:.1f} s after it was asked for"
        detail = {"stop": word.id, "reason": word.reason, "via": word.via, "asked_at": word.at.isoformat()}
        entry = AuditEntry(
            word.id, now(), word.by, "stop", f"bench {stop.bench}", "noted", {"text": text, "late_s": late_s, **detail}
        )
        if self._trail.add_once(entry) and (late_s > LATE_S or word.restored):
            log.warning("a stop of bench %s is stored %.1f s after it was requested: %s", stop.bench, late_s, text)
