"""Demands of manual mode against a bench's limits: each is refused with its field, value and range, none is clamped."""

from collections.abc import Callable, Mapping
from typing import Any

from bench_service.model.manual import DemandKind
from procedures.bench import BenchDescription
from procedures.bench.description import AxisLimits
from procedures.core.constant_rate import ConstantRate
from procedures.core.errors import BadParameter
from procedures.core.table_angles import TableAngles
from procedures.core.turn import PEAK_ACCELERATION, AxisName

AXES: tuple[AxisName, ...] = ("outer", "middle", "inner")
RAMP_SHARE = 0.5
"""Share of an axis' acceleration that ramps use where none are demanded."""
LEAST_RAMP_S = 1.0
"""Shortest ramp where none is demanded [s]."""
LONGEST_RATE_S = 3600.0
"""Longest time at a rate [s]; the lease ends it before, where it ends sooner."""
Values = dict[str, Any]


def checked(kind: DemandKind, values: Mapping[str, Any], bench: BenchDescription) -> Values:
    """Return the demand's values, with those that were left out filled in, within the limits of a bench that stands
    still. Raises `BadParameter` naming field, value and range; angles and rates are checked again where the table
    stands.
    """
    return _CHECKS[kind](values, bench)


def _nothing(values: Mapping[str, Any], bench: BenchDescription) -> Values:
    return {}


def _home(values: Mapping[str, Any], bench: BenchDescription) -> Values:
    """All axes to zero; a bench whose range leaves zero out has no home."""
    return _go_to({f"{axis}_deg": 0.0 for axis in AXES}, bench)


def _go_to(values: Mapping[str, Any], bench: BenchDescription) -> Values:
    found: Values = {}
    for axis in AXES:
        angle, limits = values.get(f"{axis}_deg"), bench.axis(axis)
        if angle is not None and not limits.minimum_deg <= angle <= limits.maximum_deg:
            allowed = f"{limits.minimum_deg:g} … {limits.maximum_deg:g}, the range of the {axis} axis"
            raise BadParameter(f"{axis}_deg", angle, allowed)
        found[f"{axis}_deg"] = angle
    if all(angle is None for angle in found.values()):
        raise BadParameter("outer_deg", None, "an angle of one axis at least; the others stay where they are")
    return found


def _rate(values: Mapping[str, Any], bench: BenchDescription) -> Values:
    axis: AxisName = values["axis"]
    limits, rate, duration = bench.axis(axis), float(values["rate_deg_s"]), float(values["duration_s"])
    most = limits.rate_deg_s
    if rate == 0.0 or not abs(rate) <= most:
        raise BadParameter("rate_deg_s", rate, f"from {-most:g} to {most:g} of the {axis} axis, and not 0")
    ramp = values.get("ramp_s")
    ramp = _ramp_s(abs(rate), limits) if ramp is None else float(ramp)
    shortest = PEAK_ACCELERATION * abs(rate) / limits.acceleration_deg_s2
    if not shortest <= ramp <= LONGEST_RATE_S / 2.0:
        allowed = f"from {shortest:.3g}, by the axis' {limits.acceleration_deg_s2:g} deg/s², to {LONGEST_RATE_S / 2:g}"
        raise BadParameter("ramp_s", ramp, allowed)
    if not 2.0 * ramp <= duration <= LONGEST_RATE_S:
        raise BadParameter("duration_s", duration, f"from two ramps, {2.0 * ramp:.3g}, to {LONGEST_RATE_S:g}")
    return {"axis": axis, "rate_deg_s": rate, "duration_s": duration, "ramp_s": ramp}


def _ramp_s(rate_deg_s: float, limits: AxisLimits) -> float:
    return max(LEAST_RAMP_S, PEAK_ACCELERATION * rate_deg_s / (RAMP_SHARE * limits.acceleration_deg_s2))


def _chamber(values: Mapping[str, Any], bench: BenchDescription) -> Values:
    limits, temperature, ramp = bench.chamber, float(values["temperature_c"]), values.get("ramp_c_min")
    if limits is None:
        raise BadParameter("kind", "chamber", f"another demand: bench {bench.id} has no thermal chamber")
    if not limits.minimum_c <= temperature <= limits.maximum_c:
        allowed = f"{limits.minimum_c:g} … {limits.maximum_c:g}, the chamber's range"
        raise BadParameter("temperature_c", temperature, allowed)
    ramp = limits.ramp_c_min if ramp is None else float(ramp)
    if not 0.0 < ramp <= limits.ramp_c_min:
        raise BadParameter("ramp_c_min", ramp, f"above 0 and at most {limits.ramp_c_min:g}")
    return {"temperature_c": temperature, "ramp_c_min": ramp}


def _supply_on(values: Mapping[str, Any], bench: BenchDescription) -> Values:
    limits, voltage, current = bench.supply, values.get("voltage_v"), values.get("current_a")
    if limits is None:
        for name, value in (("voltage_v", voltage), ("current_a", current)):
            if value is not None:
                raise BadParameter(name, value, f"null: the supply of bench {bench.id} only switches")
        return {"voltage_v": None, "current_a": None}
    voltage = limits.nominal_v if voltage is None else float(voltage)
    current = limits.nominal_a if current is None else float(current)
    if not limits.minimum_v <= voltage <= limits.maximum_v:
        raise BadParameter("voltage_v", voltage, f"{limits.minimum_v:g} … {limits.maximum_v:g}")
    if not 0.0 < current <= limits.maximum_a:
        raise BadParameter("current_a", current, f"above 0 and at most {limits.maximum_a:g}")
    return {"voltage_v": voltage, "current_a": current}


_CHECKS: dict[DemandKind, Callable[[Mapping[str, Any], BenchDescription], Values]] = {
    "home": _home,
    "go_to": _go_to,
    "rate": _rate,
    "halt": _nothing,
    "chamber": _chamber,
    "supply_on": _supply_on,
    "supply_off": _nothing,
}


def constant_rate(values: Mapping[str, Any], here: TableAngles, bench: BenchDescription) -> ConstantRate:
    """Return the motion of a rate demand, from where the table stands. Raises `BadParameter` where it would pass the
    end of the axis' range.
    """
    rate = ConstantRate(values["axis"], values["rate_deg_s"], values["duration_s"], values["ramp_s"])
    limits = bench.axis(rate.axis)
    begin: float = getattr(here, f"{rate.axis}_deg")
    room = limits.maximum_deg - begin if rate.rate_deg_s > 0.0 else begin - limits.minimum_deg
    if not limits.continuous and abs(rate.angle_deg) > room:
        longest = room / abs(rate.rate_deg_s) + rate.ramp_s
        allowed = (
            f"at most {longest:.3g}: from {begin:.4g} deg the {rate.axis} axis, which has no slip rings, would leave "
            f"{limits.minimum_deg:g} … {limits.maximum_deg:g}"
        )
        raise BadParameter("duration_s", rate.duration_s, allowed)
    return rate


def angles(values: Mapping[str, Any], here: TableAngles) -> TableAngles:
    """Return the angles that a demand asks for [deg]; an axis that it leaves out stays where it stands."""
    outer, middle, inner = (
        getattr(here, f"{axis}_deg") if values[f"{axis}_deg"] is None else values[f"{axis}_deg"] for axis in AXES
    )
    return TableAngles(outer, middle, inner)
