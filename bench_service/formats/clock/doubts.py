"""Doubts about the rate of a time column: not the declared one, unlikely, or in a unit that its name contradicts."""

import re

from bench_service.formats.clock.column import ClockColumn
from bench_service.formats.clock.pattern import Pattern
from bench_service.formats.description import SECONDS, ImportDescription
from procedures.core.errors import BadParameter
from procedures.core.recording import AROUND

CRYSTAL = 1e-4
"""Largest relative error of an ordinary quartz's rate; beyond it a doubt is reported."""
FASTEST_HZ, SLOWEST_HZ = 20_000.0, 1.0
"""Highest and lowest sample rates that are likely for an inertial unit."""
_NAMED_UNIT = re.compile(
    r"(?:^|[\s_\[(.])(ns|nsec|nanoseconds|us|µs|usec|microseconds|ms|msec|milliseconds)[\])]?$", re.IGNORECASE
)
_SPELLED = {"n": "ns", "u": "us", "µ": "us", "mic": "us", "mil": "ms", "ms": "ms"}
"""Beginning of the word in a name -> the unit."""


def require_declared(name: str, rate_hz: float, description: ImportDescription) -> None:
    """Check a measured rate against the declared one. Raises `BadParameter` where it is another one, with a likely
    reason.
    """
    declared = description.rate_hz
    if declared is None or abs(rate_hz / declared - 1.0) <= description.rate_tolerance:
        return
    factor, guess = rate_hz / declared, ""
    for size in (1e3, 1e6, 1e9):
        if abs(factor / size - 1.0) < 0.01 or abs(factor * size - 1.0) < 0.01:
            guess = f", a factor of {size:g}: is {description.time_unit} the unit of the time column?"
    raise BadParameter("rate_hz", declared, f"the time column of {name} says {rate_hz:.6g} Hz{guess}")


def doubts(
    rate_hz: float, column: ClockColumn, description: ImportDescription, column_name: str, known_s: float
) -> list[str]:
    """Return sentences of doubt about a rate that was found; `known_s` is by how much the stamps may be off."""
    found: list[str] = []
    declared = description.rate_hz
    if declared is not None:
        allowed = max(CRYSTAL, 2.0 * known_s / column.duration_s)
        off = rate_hz / declared - 1.0
        if abs(off) > allowed:
            found.append(
                f"the time column says {rate_hz:.6g} Hz, {100.0 * off:+.2g} % off the declared {declared:g} Hz, which "
                f"is used; its clock allows {100.0 * allowed:.2g} %"
            )
    found += _name_doubts(rate_hz, column, description, column_name)
    inertial = any(c.channel().quantity not in AROUND for c in description.channels)
    if inertial and declared is None and not SLOWEST_HZ <= rate_hz <= FASTEST_HZ:
        found.append(
            f"{rate_hz:.6g} Hz is an unlikely rate of an inertial unit: is the unit of time right?"
            + _likely(rate_hz * column.scale_s, description.time_unit)
        )
    return found


def clock_error_s(pattern: Pattern, resolution_s: float) -> float:
    """Return the largest error of the stamps' places, as far as known [s]."""
    return resolution_s + (0.0 if pattern.kind in ("steady", "coarse") else pattern.band_s)


def _name_doubts(rate_hz: float, column: ClockColumn, description: ImportDescription, column_name: str) -> list[str]:
    """Describe the doubt where the name of the column gives another unit than the description."""
    named = _NAMED_UNIT.search(column_name)
    unit = description.time_unit
    if named is None or unit not in SECONDS or column.scale_s != SECONDS[unit]:
        return []
    word = named.group(1).lower()
    says = next(short for start, short in _SPELLED.items() if word.startswith(start))
    if says == unit:
        return []
    as_named = rate_hz * SECONDS[unit] / SECONDS[says]
    return [
        f"the time column's name {column_name[:80]!r} says {says}, the description {unit}: {rate_hz:.6g} Hz would be "
        f"{as_named:.6g} Hz"
    ]


def _likely(per_unit: float, unit: str) -> str:
    """The units of time with which a rate would be a likely one; `per_unit` is samples in one unit of the column."""
    likely = [
        f"{per_unit / size:.6g} Hz if the column is in {other}"
        for other, size in SECONDS.items()
        if unit in SECONDS and other != unit and SLOWEST_HZ <= per_unit / size <= FASTEST_HZ
    ]
    return f" ({' or '.join(likely)})" if likely else ""
