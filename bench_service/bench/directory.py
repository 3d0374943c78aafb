"""The known benches: the one that this process drives, and all that workers have registered."""

from collections.abc import Callable, Iterable
from datetime import datetime, timedelta

from bench_service.bench.driver import BenchDriver
from bench_service.bench.registry import BenchRegistry
from bench_service.evidence.units import UnitStore
from bench_service.model.errors import NotFound
from procedures.bench import BenchDescription
from procedures.core.unit import Unit

DUE_SOON = timedelta(days=30)
"""Time before its end from which people are told of a device's certificate."""


def certificates_due(bench: BenchDescription, at: datetime) -> tuple[str, ...]:
    """Return a sentence for each certificate of a bench's devices that has expired at a moment, or does so soon."""
    today, last = at.date().isoformat(), (at + DUE_SOON).date().isoformat()
    return (*bench.overdue(today), *bench.due_between(today, last))


class BenchDirectory:
    """The benches by their names: the bench that this process drives, from its driver, and all others from the registry
    in the database.
    """

    def __init__(
        self,
        registry: BenchRegistry,
        units: UnitStore,
        driver: BenchDriver | None,
        preferred: str,
        drawn: Callable[[str], Unit | None],
        holder: Callable[[str], str | None],
    ) -> None:
        """Set up with this process's own bench (`driver`, if any) and the bench of jobs that name none (`preferred`).

        `drawn`: the unit that every simulated bench has by drawing it from its serial; None for another serial.
        `holder`: the process that drives a bench now, as text; None: no process does.
        """
        self._registry = registry
        self._units = units
        self._driver = driver
        self._preferred = preferred
        self._drawn = drawn
        self._holder = holder

    def ids(self) -> tuple[str, ...]:
        """Return the ids of all registered benches, in alphabetical order. Raises `StorageFailure`."""
        return tuple(bench.id for bench in self._registry.benches())

    def description(self, bench_id: str) -> BenchDescription:
        """Return a bench's description, of the own bench from its driver, of others from the database. Raises
        `NotFound`, naming the registered benches.
        """
        if self._driver is not None and self._driver.description.id == bench_id:
            return self._driver.description
        try:
            return self._registry.bench(bench_id)
        except NotFound:
            there = ", ".join(self.ids())
            raise NotFound("bench", bench_id, f"there is {there}" if there else "no bench is registered") from None

    def default(self) -> str:
        """Return the id of the bench for a job that names none: this process's, or the only registered one. Raises
        `NotFound` where there is no such bench.
        """
        if self._driver is not None:
            return self._driver.description.id
        ids = self.ids()
        return ids[0] if len(ids) == 1 else self._preferred

    def one(self) -> str:
        """The bench of a read-only request that names none: the default, or else the first registered one.

        Raises `NotFound` where no bench is registered.
        """
        default, ids = self.default(), self.ids()
        return default if default in ids or not ids else ids[0]

    def mounted(self, bench_id: str, serial: str | None = None) -> tuple[Unit, ...]:
        """The units that a bench can test, as declared; a simulated bench draws one for a requested `serial`, too.

        Raises `NotFound` for an unknown bench.
        """
        description = self.description(bench_id)
        if self._driver is not None and self._driver.description.id == bench_id:
            return self._driver.mounted(serial)
        units = [self._units.unit(name) for name in self._registry.mounted(bench_id)]
        drawn = self._drawn(serial) if serial is not None and description.simulated else None
        return tuple(units) if drawn is None else (*units, drawn)

    def testable(self, serials: Iterable[str]) -> frozenset[str]:
        """Select the units that some bench can test: those that it has, and those that a simulated one draws."""
        wanted, found = frozenset(serials), set[str]()
        for bench_id in self.ids():
            found |= {unit.serial for unit in self.mounted(bench_id)}
            if self.description(bench_id).simulated:
                found |= {serial for serial in wanted - found if self._drawn(serial) is not None}
        return wanted & found

    def driven(self, bench_id: str) -> bool:
        """Return whether a worker drives the bench now, that is, whether some process holds its lease."""
        return self.holder(bench_id) is not None

    def holder(self, bench_id: str) -> str | None:
        """Return who holds a bench's lease now (role, process id), as text for people; None where the lease is free."""
        return self._holder(bench_id)
