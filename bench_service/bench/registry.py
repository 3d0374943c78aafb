"""PORT of memory: registered benches, the units that each can test, and their software stops.

Every method is one transaction: it commits, or it raises and nothing of it remains.
"""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Protocol

from bench_service.model.records import BenchStop, Page
from procedures.bench import BenchDescription


class BenchRegistry(Protocol):
    """Benches that workers have registered, and their stops. A bench works only while none of its stops stands."""

    def put_bench(self, bench: BenchDescription, mounted: Sequence[str] = ()) -> None:
        """Register a bench with the serials of the units that it can test."""
        ...

    def mounted(self, bench_id: str) -> tuple[str, ...]:
        """The serials of the units that a bench can test. Raises `NotFound`."""
        ...

    def bench(self, bench_id: str) -> BenchDescription:
        """Return the description of a bench. Raises `NotFound`."""
        ...

    def benches(self) -> tuple[BenchDescription, ...]: ...

    def stop_bench(self, stop: BenchStop) -> BenchStop:
        """Add a stop to the bench; return it as it is stored. Repeated with the same id it changes nothing.

        Raises `TooManyStops` where so many stand that one more is not stored.
        """
        ...

    def stop_bench_once(self, stop: BenchStop) -> None:
        """Note a stop by the service itself, unless one for the same reason stands: a retry adds none."""
        ...

    def confirm_safe(self, bench_id: str, at: datetime, by: str) -> None:
        """Note that a stopped bench was seen safe, in every stop that stands and has no such note yet."""
        ...

    def release_stop(self, bench_id: str, stop_id: str, at: datetime, by: str, remark: str) -> BenchStop:
        """Release one standing stop; the bench works again once none stands. The same release repeated changes nothing.

        Raises `NotFound`, and `IllegalTransition` where it was released before by another person or with another
        remark.
        """
        ...

    def standing_stops(self, bench_id: str) -> tuple[BenchStop, ...]:
        """The stops that keep a bench from working, oldest first; empty where it may work."""
        ...

    def stored_stops(self, ids: Iterable[str]) -> tuple[BenchStop, ...]:
        """Those of some stops that are stored, standing or released. None is ever deleted."""
        ...

    def bench_stop(self, bench_id: str) -> BenchStop | None:
        """The oldest stop that stands; None where the bench may work."""
        ...

    def stops(self, bench_id: str, *, after: str | None = None, limit: int = 50) -> Page[BenchStop]:
        """Stops of a bench, newest first: those that stand and those that were released."""
        ...
