"""Retention of the audit trail: entries older than the setting `audit_days` are removed, stretch by stretch, and leave
checkpoints.
"""

import logging
from contextlib import ExitStack
from datetime import timedelta
from threading import Event, Thread

from bench_service.model.errors import ServiceError
from bench_service.telemetry.audit import AuditTrail, record
from bench_service.wall_clock import now

EVERY_S = 3600.0
"""Interval between two looks for entries whose retention has ended [s]."""
LEAVE_S = 1.0
"""Longest time that the end of the service waits for the thread [s]."""
BY = "retention"
"""Name under which stretches are closed."""

log = logging.getLogger(__name__)


class AuditRetention:
    """Thread that removes old stretches of one audit trail, at start and every hour."""

    def __init__(self, trail: AuditTrail, kept: timedelta) -> None:
        """Set up with `kept`: the time for which an entry is kept."""
        self._trail = trail
        self._kept = kept
        self._ending = Event()
        self._thread = Thread(target=self._run, name="audit retention", daemon=True)

    def begin(self) -> None:
        """Start the thread of the retention."""
        self._thread.start()

    def end(self) -> None:
        """End the thread and wait for it, within a limit; one that hangs in the database is left."""
        self._ending.set()
        self._thread.join(LEAVE_S)

    def look(self) -> int:
        """Remove entries that are old enough, add an entry about that, and return the number of stretches. Never raises
        for storage.
        """
        at = now()
        try:
            closed = self._trail.close(at - self._kept, BY, at)
        except ServiceError as error:
            log.error("old entries of the audit trail are not removed: %s", error)
            return 0
        for one in closed:
            detail = {"first": one.first, "last": one.last, "digest": one.digest}
            record(self._trail, BY, "close_audit", "/api/v1/audit", "noted", **detail)
        return len(closed)

    def _run(self) -> None:
        while True:
            try:
                self.look()
            except Exception:  # a defect here must not end the retention in silence
                log.exception("old entries of the audit trail could not be removed")
            if self._ending.wait(EVERY_S):
                return


def begin_retention(trail: AuditTrail, kept: timedelta, closing: ExitStack) -> None:
    """Start the retention of a trail, of entries older than `kept`; `closing` ends it."""
    retention = AuditRetention(trail, kept)
    retention.begin()
    closing.callback(retention.end)
