"""PORT of memory for units under test, as they are declared."""

from typing import Protocol

from bench_service.model.errors import NotFound
from procedures.core.unit import Unit


class UnitStore(Protocol):
    """Units under test by serial: the declared record of each."""

    def put_unit(self, unit: Unit) -> None:
        """Create or replace a unit. Its calibrations and corrections are not stored here: `ResultStore` has them."""
        ...

    def unit(self, serial: str) -> Unit:
        """Return a unit with its current calibration and corrections. Raises `NotFound`."""
        ...

    def units(self) -> tuple[Unit, ...]: ...


def register(units: UnitStore, unit: Unit) -> None:
    """Store a unit that is new; a known one stays as it is."""
    try:
        units.unit(unit.serial)
    except NotFound:
        units.put_unit(unit)
