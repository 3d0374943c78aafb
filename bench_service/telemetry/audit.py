"""Who asked what, and what became of it. Entries are added, and never changed or removed.

An entry is written when the outcome is known and before it is told, so what was acknowledged is in the trail. Where it
cannot be written (a full disk) the outcome is told all the same, and the entry goes to the log.
"""

import logging
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Protocol

from bench_service.model.errors import ServiceError
from bench_service.model.records import Page
from bench_service.wall_clock import new_id, now

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class AuditEntry:
    """One act."""

    id: str
    at: datetime
    who: str
    """As far as it is known: what the client said of itself, or where it asked from."""
    action: str
    """Name of the operation, as the API's document has it: "submit", "stop"."""
    target: str
    """Path of what it was done to, or of what it made."""
    outcome: str
    """Of a request its status code; else a word."""
    detail: dict[str, Any] = field(default_factory=dict[str, Any])


class AuditTrail(Protocol):
    """PORT of memory."""

    def add(self, entry: AuditEntry) -> None:
        """Raises `StorageFull`, `StorageFailure`."""
        ...

    def list(
        self, *, who: str | None = None, target: str | None = None, after: str | None = None, limit: int = 50
    ) -> Page[AuditEntry]:
        """Newest first; `target` is a path or one of its parts, such as an id."""
        ...


def record(trail: AuditTrail, who: str, action: str, target: str, outcome: str, **detail: Any) -> None:
    """Add an entry. Never raises for a database that fails: the act was done, whatever becomes of its record."""
    entry = AuditEntry(new_id(), now(), who, action, target, outcome, detail)
    try:
        trail.add(entry)
    except ServiceError as error:
        log.error("an entry of the audit trail could not be written (%s): %s", error, entry)
