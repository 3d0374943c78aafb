"""The audit trail: requests, their authors and outcomes. Entries are added, and never changed; a closed stretch is
removed when its retention ends, and leaves a checkpoint (`bench_service.telemetry.audit_chain`).

An entry is written after the outcome is known and before the answer, so every acknowledged act is in the trail. Where
it cannot be written (a full disk) the answer is sent all the same, and the entry goes to the log.
"""

import logging
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Protocol

from bench_service.model.errors import ServiceError
from bench_service.model.records import Page
from bench_service.telemetry.audit_chain import ChainReport, Checkpoint
from bench_service.wall_clock import new_id, now

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class AuditEntry:
    """One act in the audit trail: when, who, which action on what target, with which outcome."""

    id: str
    at: datetime
    who: str
    """Authenticated name; without accounts the name that the client gave, or the address from which it asked."""
    action: str
    """Name of the operation, as in the API's document: "submit", "stop"."""
    target: str
    """Path of the object that the act changed or made."""
    outcome: str
    """Status code of a request; of any other act a keyword."""
    detail: dict[str, Any] = field(default_factory=dict[str, Any])


class AuditTrail(Protocol):
    """Store of the audit trail: entries are added, and never changed. Interface; the SQL is in `persistence`."""

    def add(self, entry: AuditEntry) -> None:
        """Add an entry to the trail. Raises `StorageFull`, `StorageFailure`."""
        ...

    def add_once(self, entry: AuditEntry) -> bool:
        """Add an entry unless the trail has one of its id; return True where it was added. Raises as `add` does."""
        ...

    def list(
        self, *, who: str | None = None, target: str | None = None, after: str | None = None, limit: int = 50
    ) -> Page[AuditEntry]:
        """Return one page of entries, newest first, of one person or program (`who`; None: of all); `target` is a path
        or one of its parts, such as an id.
        """
        ...

    def verify(self, expected: str | None = None) -> ChainReport:
        """Check every entry and checkpoint of the chain, and that one has the `expected` digest; return the report.
        Raises `StorageFailure`.
        """
        ...

    def close(self, before: datetime, by: str, at: datetime) -> tuple[Checkpoint, ...]:
        """Remove the entries before a moment, and return the checkpoints that take the place of the removed stretches.

        Raises `IllegalTransition` where the chain is broken there: a person must look at that first.
        """
        ...


def record(trail: AuditTrail, who: str, action: str, target: str, outcome: str, **detail: Any) -> None:
    """Add an entry to the trail. Never raises for a failing database: the act was done, with or without its record."""
    write(trail, AuditEntry(new_id(), now(), who, action, target, outcome, detail))


def write(trail: AuditTrail, entry: AuditEntry) -> None:
    """Add an entry to the trail, or to the log where the database fails. Never raises for that."""
    try:
        trail.add(entry)
    except ServiceError as error:
        log.error("an entry of the audit trail could not be written (%s): %s", error, entry)
