"""Devices of a bench file as objects, and a survey of them: who answers, in which state, with which limits."""

from collections.abc import Callable, Coroutine, Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from bench_service.drivers.bench_file.document import BenchFile
from bench_service.drivers.bench_file.unit_files import read_units
from bench_service.drivers.interface.driver import DriverContext, Found, Kind, differences
from bench_service.drivers.interface.registry import driver
from bench_service.drivers.interface.sections import DeviceSection, Wire
from bench_service.drivers.wall_bench_clock import WallBenchClock
from bench_service.drivers.wired.guarded import Guarded, GuardedTurntable
from bench_service.drivers.wired.parallel import in_parallel
from bench_service.model.errors import Misconfigured
from procedures.bench import SAFE_ORDER

READ: tuple[Kind, ...] = ("turntable", "chamber", "supply", "current_source", "environment")
"""Devices that have a state to read; a unit's link sends of itself."""
SAFE: tuple[Kind, ...] = SAFE_ORDER
"""Kinds of the devices that are made safe."""


def opened(file: BenchFile, kinds: Iterable[Kind], context: DriverContext) -> dict[Kind, Any]:
    """Return the real devices of some kinds as objects, by kind. Sends nothing. Raises `Misconfigured` for a driver
    that is gone.
    """
    sections = file.real()
    return {kind: _opened(kind, sections[kind], context) for kind in kinds if kind in sections}


def _opened(kind: Kind, section: DeviceSection, context: DriverContext) -> Any:
    device = driver(kind, section.driver).open(section, context)
    if kind not in SAFE:
        return device
    return (GuardedTurntable if kind == "turntable" else Guarded)(kind, section, device)


def context_of(file: BenchFile) -> DriverContext:
    """Return the surroundings of devices that are asked outside a job: a unit that sends nothing is taken as switched
    off.
    """
    clock = WallBenchClock(factor=file.time_factor)
    return DriverContext(file.id, clock, Path(file.folder), powered=lambda: False)


@dataclass(frozen=True)
class Survey:
    """Findings of a survey of the real devices: identity and limits, readings, and failures, each by device."""

    found: dict[Kind, Found] = field(default_factory=dict[Kind, Found])
    readings: dict[Kind, Any] = field(default_factory=dict[Kind, Any])
    failures: dict[Kind, Exception] = field(default_factory=dict[Kind, Exception])

    def limit_differences(self, file: BenchFile) -> tuple[str, ...]:
        """Return sentences about limits that differ between file and devices."""
        return tuple(
            f"{kind}.{sentence}"
            for kind, found in self.found.items()
            for sentence in differences(file.devices[kind], found.limits)
        )


def survey(file: BenchFile, kinds: Iterable[Kind] | None = None) -> Survey:
    """Connect to the real devices of the `kinds` (None: all) at the same time, wait, and return identities, limits and
    readings. Commands nothing.

    A device that does not answer is among the failures, with its address.
    """
    wanted = tuple(file.real()) if kinds is None else tuple(kinds)
    context, result, devices = _context_of_survey(file, wanted), Survey(), dict[Kind, Any]()
    for kind in wanted:
        try:
            devices |= opened(file, (kind,), context)
        except Misconfigured as error:  # such as a unit that its link cannot be for
            result.failures[kind] = error
    deadlines: dict[Kind, float] = {}
    work: dict[Kind, Callable[[], Coroutine[Any, Any, tuple[Found, Any]]]] = {}
    for kind, device in devices.items():
        section = file.devices[kind]
        assert isinstance(section, Wire)
        deadlines[kind] = section.connect_s + 4.0 * section.answer_s
        work[kind] = partial(_ask, kind, device)
    for kind, outcome in in_parallel(work, deadlines).items():
        if isinstance(outcome, Exception):
            result.failures[kind] = outcome
        else:
            result.found[kind], reading = outcome
            if reading is not None:
                result.readings[kind] = reading
    return result


def _context_of_survey(file: BenchFile, wanted: Iterable[Kind]) -> DriverContext:
    """A unit's link is asked for the first declared unit: which one is on the bench, only a job knows."""
    units = read_units(file.folder / "units") if "unit_link" in wanted else ()
    return replace(context_of(file), unit=units[0] if units else None)


async def _ask(kind: Kind, device: Any) -> tuple[Found, Any]:
    try:
        found = await device.connect()
        return found, await device.read() if kind in READ else None
    finally:
        device.close()
