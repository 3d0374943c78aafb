"""Interface of the store of remarks about units."""

from typing import Protocol

from bench_service.model.notes import UnitNote
from bench_service.model.records import Idempotency, Page


class UnitNoteStore(Protocol):
    """Store of people's remarks about units. Interface; the SQL is in `persistence`."""

    def add(self, note: UnitNote, idempotency: Idempotency | None = None) -> UnitNote:
        """Store a remark. A known key returns the remark that it stored before. Raises `IdempotencyConflict` for a key
        of another request.
        """
        ...

    def list(self, unit: str, *, after: str | None = None, limit: int = 50) -> Page[UnitNote]:
        """Return one page of a unit's remarks, newest first."""
        ...
