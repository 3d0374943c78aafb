"""Registry of device drivers: those that ship, and those of installed packages (entry point group ``bench.drivers``).

A driver is imported when a bench file names it, so that the supervisor loads only those that it needs. An entry point's
name is the driver's; its object is a `DeviceDriver`, or a sequence of those with the same name for several kinds.
"""

from collections.abc import Iterable, Sequence
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from bench_service.drivers.interface.driver import DeviceDriver, Kind
from bench_service.model.errors import Misconfigured

GROUP = "bench.drivers"
SHIPPED: dict[tuple[Kind, str], str] = {
    ("turntable", "acutrol"): "bench_service.drivers.devices.acutrol_turntable:DRIVER",
    ("chamber", "simserv"): "bench_service.drivers.devices.simserv_chamber:DRIVER",
    ("chamber", "ascii2"): "bench_service.drivers.devices.ascii2_chamber:DRIVER",
    ("chamber", "modbus"): "bench_service.drivers.devices.modbus_chamber:DRIVER",
    ("supply", "scpi"): "bench_service.drivers.devices.scpi_supply:DRIVER",
    ("unit_link", "framed"): "bench_service.drivers.devices.framed_unit:DRIVER",
    ("unit_link", "ixcom"): "bench_service.drivers.devices.ixcom_unit:DRIVER",
}
"""Kind and name of each driver that ships -> "module:attribute" of its `DeviceDriver`."""


def driver(kind: Kind, name: str) -> DeviceDriver[Any]:
    """Import and return a driver by its kind and name. Raises `Misconfigured` naming the drivers of this kind."""
    shipped = SHIPPED.get((kind, name))
    if shipped is not None:
        module, _, attribute = shipped.partition(":")
        return getattr(import_module(module), attribute)
    found = [made for entry in entry_points(group=GROUP, name=name) for made in _loaded(entry) if made.kind == kind]
    if len(found) > 1:
        raise Misconfigured(f"driver = {name!r}: {len(found)} installed packages have a {kind} driver of this name")
    if not found:
        raise Misconfigured(
            f"driver = {name!r}: there is no such driver of a {kind}; there is {', '.join(names(kind))}"
        )
    return found[0]


def names(kind: Kind) -> tuple[str, ...]:
    """Return the names of all drivers of a kind, "simulated" first; one of an installed package that fails to load is
    left out.
    """
    found = {name for of_kind, name in SHIPPED if of_kind == kind}
    for entry in entry_points(group=GROUP):
        try:
            found |= {made.name for made in _loaded(entry) if made.kind == kind}
        except Misconfigured:
            continue
    return ("entered" if kind == "environment" else "simulated", *sorted(found))


def _loaded(entry: EntryPoint) -> Sequence[DeviceDriver[Any]]:
    """The drivers of an entry point. Raises `Misconfigured` where its package cannot be used."""
    try:
        made = entry.load()
    except Exception as error:  # of a laboratory's own package: anything
        raise Misconfigured(f"driver = {entry.name!r}: {entry.value} cannot be loaded: {error}") from error
    drivers = (made,) if isinstance(made, DeviceDriver) else tuple(made) if isinstance(made, Iterable) else ()
    if not drivers or not all(isinstance(one, DeviceDriver) and one.name == entry.name for one in drivers):
        raise Misconfigured(f"driver = {entry.name!r}: {entry.value} is not a DeviceDriver of that name")
    return drivers
