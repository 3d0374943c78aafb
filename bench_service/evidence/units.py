"""Interface of the store of units under test, as they are declared."""

from collections.abc import Collection
from typing import Protocol

from bench_service.model.errors import NotFound
from procedures.core.unit import Unit


class UnitStore(Protocol):
    """Store of units under test by serial: the declared record of each. Interface; the SQL is in `persistence`."""

    def put_unit(self, unit: Unit) -> None:
        """Store or replace a unit's record. Its calibrations and corrections are not stored here: `ResultStore` has
        them.
        """
        ...

    def unit(self, serial: str) -> Unit:
        """Return a unit with its current calibration and corrections. Raises `NotFound`."""
        ...

    def units(self, serials: Collection[str] | None = None) -> tuple[Unit, ...]:
        """Return the units with these serials, or all of them, in the order of the serials."""
        ...

    def serials(self) -> tuple[str, ...]:
        """Return the serials of all units in their order, without their records."""
        ...


def register(units: UnitStore, unit: Unit) -> None:
    """Store a unit that is new; a known one stays as it is."""
    try:
        units.unit(unit.serial)
    except NotFound:
        units.put_unit(unit)
