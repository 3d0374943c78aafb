"""Reservations of a unit or a bench: jobs of other holders wait until the reservation ends."""

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Protocol

from bench_service.model.records import Idempotency, Page


class Reserved(StrEnum):
    """The kinds of things that can be reserved: a bench, a unit."""

    BENCH = "bench"
    UNIT = "unit"


@dataclass(frozen=True)
class Reservation:
    """A reservation of a unit or bench. It ends by itself at `until`, or earlier, when its holder gives it back."""

    id: str
    kind: Reserved
    name: str
    """The bench's id or the unit's serial."""
    holder: str
    created_at: datetime
    until: datetime
    note: str = ""
    team: str = ""
    """Team whose members act on it and on its jobs, from the account or token that made it; empty: everybody."""
    ended_at: datetime | None = None
    """Time when its holder gave it back early."""

    def active(self, at: datetime) -> bool:
        """Return whether it holds at a moment: not given back, before `until`; `reservation_store.py` has it in SQL."""
        return self.ended_at is None and at < self.until

    def admits(self, other: "Reservation | None") -> bool:
        """Return whether a job under another reservation need not wait for this one: same holder, or same team. `other`
        None: a job without a reservation.
        """
        if other is None:
            return False
        return other.holder == self.holder or (bool(self.team) and other.team == self.team)

    @property
    def over_at(self) -> datetime:
        """Time at which the reservation ended or will end."""
        return self.until if self.ended_at is None else self.ended_at


class ReservationStore(Protocol):
    """Store of all reservations. Every method is one transaction. Interface; the SQL is in `persistence`."""

    def add(self, reservation: Reservation, idempotency: Idempotency | None = None) -> Reservation:
        """Store a reservation that begins at its `created_at`, and return it. Raises `AlreadyReserved`,
        `IdempotencyConflict`.
        """
        ...

    def get(self, reservation_id: str) -> Reservation:
        """Return one reservation by its id. Raises `NotFound`."""
        ...

    def list(
        self, *, active_at: datetime | None = None, after: str | None = None, limit: int = 50
    ) -> Page[Reservation]:
        """Return one page of reservations, newest first; with `active_at` only those that hold at that moment."""
        ...

    def active(self, at: datetime) -> tuple[Reservation, ...]:
        """Return every reservation that holds at a moment, oldest first."""
        ...

    def end(self, reservation_id: str, at: datetime) -> Reservation:
        """End a reservation early and return it; one that is over stays as it is. Raises `NotFound`."""
        ...


def reservation_of_bench(store: ReservationStore, bench_id: str, at: datetime) -> Reservation | None:
    """Return the reservation that a bench is under at a moment; None where it is under none."""
    return next((one for one in store.active(at) if one.kind is Reserved.BENCH and one.name == bench_id), None)
