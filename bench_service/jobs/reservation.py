"""A unit or a bench that somebody keeps for a while: jobs of others wait until the reservation ends."""

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Protocol

from bench_service.model.records import Idempotency, Page


class Reserved(StrEnum):
    """What can be reserved."""

    BENCH = "bench"
    UNIT = "unit"


@dataclass(frozen=True)
class Reservation:
    """One reservation. It ends by itself at `until`, or before, when its holder gives it back."""

    id: str
    kind: Reserved
    name: str
    """The bench's id or the unit's serial."""
    holder: str
    created_at: datetime
    until: datetime
    note: str = ""
    ended_at: datetime | None = None
    """When it was given back before its time."""

    def active(self, at: datetime) -> bool:
        """Whether it holds at a moment: the one place where a reservation's end is compared with a clock."""
        return self.ended_at is None and at < self.until

    @property
    def over_at(self) -> datetime:
        """When it ended, or will end by itself."""
        return self.until if self.ended_at is None else self.ended_at


class ReservationStore(Protocol):
    """Reservations, as they are kept. Every method is one transaction."""

    def add(self, reservation: Reservation, idempotency: Idempotency | None = None) -> Reservation:
        """Keep a reservation, at its `created_at`. Raises `AlreadyReserved`, `IdempotencyConflict`."""
        ...

    def get(self, reservation_id: str) -> Reservation:
        """Raises `NotFound`."""
        ...

    def list(
        self, *, active_at: datetime | None = None, after: str | None = None, limit: int = 50
    ) -> Page[Reservation]:
        """Newest first; with `active_at` only those that hold at that moment."""
        ...

    def end(self, reservation_id: str, at: datetime) -> Reservation:
        """Give it back before its time; one that is over stays as it is. Raises `NotFound`."""
        ...
