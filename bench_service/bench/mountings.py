"""Mountings of units on benches: interface of their store, and entering one.

A job rests on the mounting of its unit that stands on its bench. A plate holds one unit, and a unit is on one plate: a
new mounting ends the ones before it of the same unit and of the same plate.
"""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Protocol

from bench_service.mapping import copied
from bench_service.model.mountings import StoredMounting
from bench_service.model.records import Idempotency, Page
from bench_service.wall_clock import new_id, now
from procedures.core.errors import BadParameter

EARLIEST = datetime(1970, 1, 1, tzinfo=UTC)
"""Earliest moment of a mounting that is accepted."""
AHEAD = timedelta(minutes=1)
"""Time by which a client's clock may be ahead of this one."""


class MountingStore(Protocol):
    """Store of mountings, standing and ended. Every method is one transaction. Interface; the SQL is in
    `persistence`.
    """

    def add(self, mounting: StoredMounting, idempotency: Idempotency | None = None) -> StoredMounting:
        """Store a mounting; the ones before it of its unit and of its plate end.

        Raises `BenchBusy` while a job drives the bench, `IdempotencyConflict`.
        """
        ...

    def get(self, mounting_id: str) -> StoredMounting:
        """Return one mounting by its id. Raises `NotFound`."""
        ...

    def standing(self, unit: str, bench: str) -> StoredMounting | None:
        """Return the mounting of a unit that stands on a bench; None where the unit is not mounted there."""
        ...

    def list(
        self,
        *,
        unit: str | None = None,
        bench: str | None = None,
        standing: bool = False,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[StoredMounting]:
        """Return one page of the mountings of a unit or on a bench, newest first; `standing`: only those that have not
        ended.
        """
        ...

    def end(self, mounting_id: str, at: datetime, by: str) -> StoredMounting:
        """Take the unit off. A mounting that has ended stays as it is. Raises `BenchBusy`, `NotFound`."""
        ...


@dataclass(frozen=True)
class MountingEntry:
    """A mounting as a person enters it: unit, bench, plate, and the azimuth that was read, with its uncertainty."""

    unit: str
    bench: str
    plate: str
    by: str
    proven: bool
    azimuth_deg: float
    azimuth_sd_arcsec: float
    mounted_at: datetime | None = None
    """Moment of the mounting; None: now."""
    instrument: str = ""
    remark: str = ""


def new_mounting(entry: MountingEntry) -> StoredMounting:
    """Make a mounting, with a new id, from a person's entry. Raises `BadParameter` for a time in the future, or before
    1970.
    """
    at = now()
    if entry.mounted_at is not None and not EARLIEST <= entry.mounted_at <= at + AHEAD:
        raise BadParameter("mounted_at", entry.mounted_at.isoformat(), f"from 1970 to now, {at.isoformat()}")
    return copied(StoredMounting, entry, id=new_id(), entered_at=at, mounted_at=entry.mounted_at or at)
