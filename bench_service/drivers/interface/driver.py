"""A driver of one kind of device: the section of a bench file that it reads, and the device that it makes of it.

Rules of a driver (docs/add-a-device.md has them all):

* `DeviceDriver.open` sends nothing and waits for nothing. The first awaited verb makes the link; after each new link
  the device is identified and its status read before any demand.
* A device is used from one event loop, that of its first verb. `close` may be called from any thread, at any time.
* A demand is held to the narrower of the section's limits and the device's own (`narrowest`), read back after it was
  sent, and never sent again after a lost answer. A read may be repeated over a new link.
* A late answer never answers a later request: where an answer did not come within `answer_s`, the link is dropped.
* `make_safe` obeys the section's `on_safe`, starts nothing that stands still, and returns once the device reads back as
  safe; the caller sets its deadline (`safe_s`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, Literal, Protocol, TypeVar

from bench_service.drivers.interface.sections import DeviceSection, Section
from procedures.bench.clock import Clock
from procedures.bench.device import Device, DeviceIdentity, Status
from procedures.core.unit import Unit

Kind = Literal["turntable", "chamber", "supply", "unit_link", "current_source", "environment"]
KINDS: tuple[Kind, ...] = ("turntable", "chamber", "supply", "unit_link", "current_source", "environment")
"""Kinds of device that a driver can make: the sections' names in a bench file."""

S = TypeVar("S", bound=DeviceSection)
P = TypeVar("P", bound=Section)


def _untold(_event: str, _more: Mapping[str, Any]) -> None:
    return


@dataclass(frozen=True)
class DriverContext:
    """Surroundings of a device for its driver: bench id, clock, folder of the bench file, declared unit, function for
    notes.
    """

    bench_id: str
    clock: Clock
    """Clock of the bench: bench time of readings. A time-out of a link is real time, `asyncio.timeout`."""
    folder: Path
    """Folder of the bench file, to which relative file names in a section refer."""
    unit: Unit | None = None
    """The declared unit on the bench, for a unit's link: its channels and its sample rate; None: not known."""
    powered: Callable[[], bool] = lambda: True
    """For a unit's link: False while the supply's output is known to be off; waits for nothing."""
    note: Callable[[str, Mapping[str, Any]], None] = field(default=_untold, repr=False)
    """Writes an event into the devices' journal, such as ("turntable.status", {"word": …}): for links lost and made,
    status words that changed, frames that were lost. Waits for nothing.
    """
    time_factor: float = 1.0
    """Bench seconds in a real second: other than 1 for served simulators alone, whose data come faster by as much."""


@dataclass(frozen=True)
class Bound:
    """A limit that the device itself has: the path of the section's field, and the device's value."""

    field: str
    """Limited quantity, such as "outer.rate_deg_s" or "limits.maximum_c"; a lower limit's name begins with
    "minimum"."""
    value: float

    @property
    def lower(self) -> bool:
        """True where smaller demands are refused, False where larger ones are."""
        return self.field.rpartition(".")[2].startswith("minimum")


@dataclass(frozen=True)
class Found:
    """Findings of a new link: the device's identity, status, and its own limits as far as it reports them."""

    identity: DeviceIdentity
    status: Status = ()
    limits: tuple[Bound, ...] = ()


class WireDevice(Device, Protocol):
    """A device that a driver makes: an interface of `procedures.bench` with two more verbs, to connect and to close."""

    async def connect(self) -> Found:
        """Make the link if there is none, identify the device, read its status and limits. Commands nothing.

        Raises `Disconnected`, and `DeviceFault` where another kind of device answers.
        """
        ...

    def close(self) -> None:
        """Drop the link; commands nothing and does not wait. Verbs under way raise `Disconnected`."""
        ...


@dataclass(frozen=True)
class DeviceDriver(Generic[S]):
    """A driver as the registry knows it: kind, name, model of its section, and the function that makes the device."""

    kind: Kind
    name: str
    """The value of `driver` in a bench file."""
    section: type[S]
    """Its section: a subclass of the kind's base in `sections`, with the fields that this driver adds."""
    open: Callable[[S, DriverContext], Any]
    """Function that returns the device, which implements the kind's port of `procedures.bench` and `WireDevice`; it
    sends nothing."""


def narrowest(declared: float, own: float | None, lower: bool) -> float:
    """Return the narrower of a declared limit and the device's own; `own` None: the device does not report it. `lower`:
    True for a limit below which demands are refused.
    """
    if own is None:
        return declared
    return max(declared, own) if lower else min(declared, own)


def differences(section: DeviceSection, bounds: Sequence[Bound]) -> tuple[str, ...]:
    """Return sentences about limits in which section and device differ, each with the one that holds."""
    found: list[str] = []
    for bound in bounds:
        declared = _value(section, bound.field)
        if declared is not None and declared != bound.value:
            held = narrowest(declared, bound.value, bound.lower)
            found.append(f"{bound.field}: the file has {declared:g}, the device {bound.value:g}; {held:g} holds")
    return tuple(found)


def narrowed(section: S, bounds: Sequence[Bound]) -> S:
    """Return the section with the narrower of its limits and the device's own. Raises `ValueError` where a bound names
    no number of the section.
    """
    for bound in bounds:
        section = _with(section, bound.field.split("."), bound)
    return section


def _with(part: P, path: Sequence[str], bound: Bound) -> P:
    """A copy of a table in which the number at a path is held to a bound."""
    first, *rest = path
    value = getattr(part, first, None)
    if rest and isinstance(value, Section):
        return part.model_copy(update={first: _with(value, rest, bound)})
    if rest or value is None or not _is_number(value):
        raise ValueError(f"{type(part).__name__} has no limit {bound.field!r}")
    return part.model_copy(update={first: narrowest(value, bound.value, bound.lower)})


def _value(section: DeviceSection, path: str) -> float | None:
    """The number at a path; None where there is none."""
    here: Any = section
    for name in path.split("."):
        here = getattr(here, name, None)
    return float(here) if _is_number(here) else None


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
