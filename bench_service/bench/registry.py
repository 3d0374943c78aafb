"""Interface of the registry of benches: their descriptions, the units that each can test, and their software stops.

Every method is one transaction: it commits, or it raises and nothing of it remains.
"""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Protocol

from bench_service.model.records import BenchStop, Page
from procedures.bench import BenchDescription


class BenchRegistry(Protocol):
    """Registry of the benches that workers have registered, and of their stops. A bench works only while none of its
    stops stands. Interface; the SQL is in `persistence`.
    """

    def put_bench(self, bench: BenchDescription, mounted: Sequence[str] = ()) -> None:
        """Register a bench, or replace its description, with the serials of the units that it can test."""
        ...

    def mounted(self, bench_id: str) -> tuple[str, ...]:
        """Return the serials of the units that a bench can test. Raises `NotFound` for an unknown bench."""
        ...

    def bench(self, bench_id: str) -> BenchDescription:
        """Return the description of a bench. Raises `NotFound` for an unknown bench."""
        ...

    def benches(self) -> tuple[BenchDescription, ...]: ...

    def stop_bench(self, stop: BenchStop) -> BenchStop:
        """Add a stop to the bench; return it as it is stored. Repeated with the same id it changes nothing.

        Raises `TooManyStops` where so many stand that one more is not stored.
        """
        ...

    def stop_bench_once(self, stop: BenchStop) -> None:
        """Store a stop by the service itself, unless one for the same reason stands: a retry adds none."""
        ...

    def confirm_safe(self, bench_id: str, at: datetime, by: str) -> None:
        """Store when and by which process a stopped bench was seen safe, in every standing stop that has no such note
        yet.
        """
        ...

    def release_stop(self, bench_id: str, stop_id: str, at: datetime, by: str, remark: str) -> BenchStop:
        """Release one standing stop; the bench works again once none stands. The same release repeated changes nothing.

        Raises `NotFound`, and `IllegalTransition` where it was released before by another person or with another
        remark.
        """
        ...

    def standing_stops(self, bench_id: str) -> tuple[BenchStop, ...]:
        """Return the stops that keep a bench from working, oldest first; empty where it may work."""
        ...

    def stored_stops(self, ids: Iterable[str]) -> tuple[BenchStop, ...]:
        """Return, of the stops with these ids, those that are stored, standing or released. No stop is ever deleted."""
        ...

    def bench_stop(self, bench_id: str) -> BenchStop | None:
        """Return the oldest stop of a bench that stands; None where the bench may work."""
        ...

    def stops(self, bench_id: str, *, after: str | None = None, limit: int = 50) -> Page[BenchStop]:
        """Return one page of a bench's stops, newest first, standing and released."""
        ...
