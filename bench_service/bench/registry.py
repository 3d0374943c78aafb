"""PORT of memory: benches by name, the units that each can test, and the software stop of each.

Every method is one transaction: it commits, or it raises and nothing of it remains.
"""

from collections.abc import Sequence
from datetime import datetime
from typing import Protocol

from bench_service.model.records import BenchStop
from procedures.bench import BenchDescription


class BenchRegistry(Protocol):
    """Benches that workers have registered, and the stops that stand."""

    def put_bench(self, bench: BenchDescription, mounted: Sequence[str] = ()) -> None:
        """Register a bench with the serials of the units that it can test."""
        ...

    def mounted(self, bench_id: str) -> tuple[str, ...]:
        """The serials of the units that a bench can test. Raises `NotFound`."""
        ...

    def bench(self, bench_id: str) -> BenchDescription:
        """Raises `NotFound`."""
        ...

    def benches(self) -> tuple[BenchDescription, ...]: ...

    def stop_bench(self, stop: BenchStop) -> None:
        """Note that a bench was stopped; it stays so until it is released. A second stop changes nothing."""
        ...

    def confirm_safe(self, bench_id: str, at: datetime, by: str) -> None:
        """Note that a stopped bench was seen safe; only the first time counts, and only while the stop stands."""
        ...

    def release_bench(self, bench_id: str) -> None:
        """Let the bench work again; one that is not stopped stays as it is."""
        ...

    def bench_stop(self, bench_id: str) -> BenchStop | None:
        """Why the bench stands still, if a person stopped it."""
        ...
