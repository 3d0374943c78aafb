"""PORT of memory for remarks about units."""

from typing import Protocol

from bench_service.model.notes import UnitNote
from bench_service.model.records import Idempotency, Page


class UnitNoteStore(Protocol):
    """PORT: remarks of people about units."""

    def add(self, note: UnitNote, idempotency: Idempotency | None = None) -> UnitNote:
        """Store a remark; with a key that is known, return the one that it made."""
        ...

    def list(self, unit: str, *, after: str | None = None, limit: int = 50) -> Page[UnitNote]:
        """List a unit's remarks, newest first."""
        ...
