"""Rules that every chamber's driver keeps before it sends a demand."""

from collections.abc import Awaitable, Callable
from math import isfinite

from bench_service.drivers.interface.driver import Bound, narrowest
from bench_service.drivers.interface.sections import ChamberBounds, WireChamber
from procedures.bench.chamber import ChamberLimits
from procedures.bench.errors import DeviceFault, OutOfRange


def limits_of(bounds: ChamberBounds, own: tuple[Bound, ...] = ()) -> ChamberLimits:
    """Return the limits of demands: the narrower of the section's and the chamber's own."""
    found = {bound.field: bound for bound in own}

    def held(name: str) -> float:
        bound = found.get(f"limits.{name}")
        declared = float(getattr(bounds, name))
        return declared if bound is None else narrowest(declared, bound.value, bound.lower)

    return ChamberLimits(held("minimum_c"), held("maximum_c"), held("ramp_c_min"), bounds.ambient_c)


def require_allowed(limits: ChamberLimits, temperature_c: float, ramp_c_min: float) -> None:
    """Check temperature and ramp of a demand against the limits. Raises `OutOfRange`."""
    if not (isfinite(temperature_c) and limits.minimum_c <= temperature_c <= limits.maximum_c):
        raise OutOfRange(f"temperature_c = {temperature_c!r} is outside {limits.minimum_c:g} … {limits.maximum_c:g}")
    if not 0.0 < ramp_c_min <= limits.ramp_c_min:
        raise OutOfRange(f"ramp_c_min = {ramp_c_min!r} must be above 0 and at most {limits.ramp_c_min:g}")


def require_fit(door_open: bool, tripped: bool, words: str = "") -> None:
    """Check that the chamber may be commanded: door closed, no alarm. Raises `DeviceFault`; nothing is reset."""
    if tripped:
        raise DeviceFault(
            f"the chamber has switched itself off{f' ({words})' if words else ''}: a person must reset it"
        )
    if door_open:
        raise DeviceFault("the chamber's door is open")


def require_same(name: str, demanded: float, found: float, tolerance: float) -> None:
    """Check a value that was read back against the demanded one. Raises `DeviceFault` beyond the tolerance."""
    if abs(found - demanded) > tolerance:
        raise DeviceFault(f"the chamber was set to {name} {demanded:g} and reads back {found:g}")


async def obey_on_safe(
    section: WireChamber,
    limits: ChamberLimits,
    end: Callable[[], Awaitable[object]],
    lead: Callable[[float, float], Awaitable[object]],
) -> None:
    """Make a running chamber safe as its section's `on_safe` says: leave it, end its run, or command it to ambient.

    `lead` takes a temperature [°C] and a ramp [°C/min]. Not to be called for one that stands still: it gets no demand.
    """
    if section.on_safe == "off":
        await end()
    elif section.on_safe != "hold":
        await lead(limits.ambient_c, limits.ramp_c_min)
