"""What a time column says: the rate, what was lost or written twice, and what is refused or only worth a warning."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench_service.formats.clock.column import ClockColumn, Fall
from bench_service.formats.clock.pattern import Pattern, find_pattern
from bench_service.formats.clock.rate import KeptRows, MeanRate, mean_rate
from bench_service.formats.description import SECONDS, ImportDescription
from bench_service.formats.errors import UnreadableFile
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import Quantity

SHOWN_PLACES = 5
CRYSTAL = 1e-4
"""By so much the rate of an ordinary quartz may be off what is declared; more is said."""
FASTEST_HZ, SLOWEST_HZ = 20_000.0, 1.0
"""Beyond them a rate is unlikely for an inertial unit."""
LOST_DIGITS = 10.0
"""Ratio of the resolutions within one column that shows digits lost in printing."""
_NAMED_UNIT = re.compile(
    r"(?:^|[\s_\[(.])(ns|nsec|nanoseconds|us|µs|usec|microseconds|ms|msec|milliseconds)[\])]?$", re.I
)
_SPELLED = {"n": "ns", "u": "us", "µ": "us", "m": "ms"}
_UNIT = {size: unit for unit, size in SECONDS.items()}
_NO_ROWS = np.empty(0, np.int64)


@dataclass(frozen=True)
class ClockFindings:
    """A time column that was accepted."""

    rate_hz: float
    """Samples over time, those that are lost counted in."""
    repeats: NDArray[np.int64]
    """Rows, from 0 in what is read, that are to be left out."""
    gaps: NDArray[np.int64]
    """Rows, from 0 in what is read, after which samples are lost."""
    lost: NDArray[np.int64]
    """How many, for each of `gaps`."""
    warnings: tuple[str, ...]
    document: dict[str, Any]
    """The same as JSON, to be kept with the recording."""


def judge(name: str, column: ClockColumn, description: ImportDescription, column_name: str) -> ClockFindings:
    """Judge the time column of a file. Raises `UnreadableFile`, `UnfitRecording`, `BadParameter`, each with a way out."""
    if column.count < 2:
        raise UnreadableFile(name, "has fewer than two rows: no rate can be found in its time column")
    _require_growing(name, column, description)
    repeats = _repeats(column)
    rows = KeptRows(column, repeats)
    resolution_s = column.resolution.finest * column.scale_s
    declared_s = None if description.rate_hz is None else 1.0 / description.rate_hz
    pattern = find_pattern(rows.sample(), resolution_s, description.gap_tolerance, declared_s)
    tolerances = description.gap_tolerance, description.rate_tolerance
    coarsest = column.resolution.later * column.scale_s
    lost_digits = coarsest >= 0.99 * LOST_DIGITS * resolution_s and not column.wraps
    mean = mean_rate(rows, pattern, tolerances, (resolution_s, coarsest if lost_digits else resolution_s))
    table_rows = rows.row(mean.places.rows)
    _require_whole(name, column, description, repeats, table_rows, mean)
    _require_uniform(name, rows, mean, description)
    warnings = [
        *_counted(column, description, repeats, table_rows, mean),
        *_arrival(pattern, mean, resolution_s),
        *(_printing(resolution_s, coarsest, mean) if lost_digits else ()),
        *_rate_doubts(mean.rate_hz, column, description, column_name, pattern, resolution_s),
    ]
    _require_declared(name, mean.rate_hz, description)
    positive = mean.places.samples > 0
    return ClockFindings(
        rate_hz=mean.rate_hz,
        repeats=repeats,
        gaps=table_rows[positive],
        lost=mean.places.samples[positive],
        warnings=tuple(warnings),
        document={
            "rate_hz": mean.rate_hz,
            "resolution_s": resolution_s,
            "arrival": pattern.kind,
            "rows_in_a_batch": pattern.batch,
            "repeated_rows": len(repeats),
            "lost_samples": mean.places.lost,
            "places": [
                {"after_row": int(row) + description.rows.first, "lost": int(lost)}
                for row, lost in zip(table_rows[positive][:100], mean.places.samples[positive][:100], strict=True)
            ],
            "wraps": [
                {"after_row": fall.row + description.rows.first - 1, "period": fall.wrap} for fall in column.wraps
            ],
        },
    )


def _require_growing(name: str, column: ClockColumn, description: ImportDescription) -> None:
    """Raises `UnfitRecording` where the time falls, or never moves."""
    if column.fall_count:
        first = column.falls[0]
        where = _fall(first, column, description)
        if first.wrap is not None:
            raise UnfitRecording(
                f"{name}: the clock wraps at {first.wrap}: {where}; unwrap_clock = true carries it on"
                + _others(column.fall_count - 1)
            )
        unpadded = (
            '; where milliseconds are written without leading zeros (31.18 for 31.018), ask for clock_fraction = "ms"'
            if description.time_unit == "clock" and description.clock_fraction == "decimal"
            else "; nothing is sorted: give the rows before or after it (rows), or leave time_column out and give rate_hz"
        )
        raise UnfitRecording(f"{name}: the time does not grow: {where}{_others(column.fall_count - 1)}{unpadded}")
    if column.duration_s == 0.0:
        raise UnfitRecording(
            f"{name}: all {column.count} rows have the time {column.first!r}: digits were lost when it was printed, or "
            "it is no time; leave time_column out and give rate_hz"
        )


def _fall(fall: Fall, column: ClockColumn, description: ImportDescription) -> str:
    row = fall.row + description.rows.first - 1
    unit = "s" if description.time_unit == "clock" else _UNIT[column.scale_s]
    size = 1e-9 if description.time_unit == "clock" else 1
    before, after = (str(v) if isinstance(v, int) else f"{v:.15g}" for v in (fall.before * size, fall.after * size))
    return f"{before} {unit} in row {row}, {after} {unit} in row {row + 1}"


def _others(count: int) -> str:
    return f", and falls in {count} more place{'s' if count > 1 else ''}" if count else ""


def _repeats(column: ClockColumn) -> NDArray[np.int64]:
    """Rows that were written twice: with one time, the same values, and equal values elsewhere the exception."""
    repeats = column.repeats
    moving = column.count - column.still
    elsewhere = column.same - len(repeats)
    if len(repeats) < 0.9 * column.still or column.still > 0.6 * column.count or elsewhere > 0.1 * moving:
        return _NO_ROWS
    return repeats


def _require_whole(
    name: str,
    column: ClockColumn,
    description: ImportDescription,
    repeats: NDArray[np.int64],
    rows: NDArray[np.int64],
    mean: MeanRate,
) -> None:
    """Raises `UnfitRecording` with all that is lost and doubled, and the way out."""
    problems: list[str] = []
    ways: list[str] = []
    if len(repeats) and description.repeats == "refuse":
        problems.append(_said_repeats(column, description, repeats))
        ways.append('repeats = "drop" leaves the second of each out')
    if mean.places.lost and description.gaps == "refuse":
        problems.append(_said_losses(column, description, rows, mean))
        ways.append('gaps = "mark" puts NaN in the place of each lost sample')
        ways += _range_without(column, description, rows, mean)
    if mean.places.surplus:
        problems.append(_said_surplus(column, description, rows, mean))
        ways.append("the clock was set, or rows of two sources are mixed: give a range without it (rows)")
    if problems:
        ways.append("leave time_column out and give rate_hz to take the rows as they follow")
        raise UnfitRecording(f"{name}: at {mean.rate_hz:.6g} Hz {'; '.join(problems)}. Ways out: {'; '.join(ways)}")


def _range_without(
    column: ClockColumn, description: ImportDescription, rows: NDArray[np.int64], mean: MeanRate
) -> list[str]:
    """A range of rows that has no gap, where the gaps are at the beginning alone."""
    gaps = rows[mean.places.samples > 0]
    last = int(gaps[-1]) + 1
    if last > 0.05 * column.count:
        return []
    return [f'rows = {{"first": {last + description.rows.first}}} begins after {"it" if len(gaps) == 1 else "them"}']


def _said_repeats(column: ClockColumn, description: ImportDescription, repeats: NDArray[np.int64]) -> str:
    shown = [f"row {int(r) + description.rows.first}" for r in repeats[:SHOWN_PLACES]]
    times = [f" ({_at(column, int(r))})" for r in repeats[:SHOWN_PLACES]]
    places = ", ".join(a + b for a, b in zip(shown, times, strict=True)) + _more(len(repeats))
    return (
        f"{len(repeats)} row{'s repeat' if len(repeats) > 1 else ' repeats'} the row before, time and values: {places}"
    )


def _said_losses(column: ClockColumn, description: ImportDescription, rows: NDArray[np.int64], mean: MeanRate) -> str:
    positive = mean.places.samples > 0
    return (
        f"{mean.places.lost} {'samples are' if mean.places.lost > 1 else 'sample is'} missing in {int(positive.sum())} place{'s' if positive.sum() > 1 else ''}: "
        + _places(column, description, rows[positive], mean.places.samples[positive])
    )


def _said_surplus(column: ClockColumn, description: ImportDescription, rows: NDArray[np.int64], mean: MeanRate) -> str:
    negative = mean.places.samples < 0
    return f"the time has no room for {mean.places.surplus} of the rows: " + _places(
        column, description, rows[negative], -mean.places.samples[negative]
    )


def _places(
    column: ClockColumn, description: ImportDescription, rows: NDArray[np.int64], samples: NDArray[np.int64]
) -> str:
    shown = [
        f"{int(n)} between rows {int(row) + description.rows.first} and {int(row) + description.rows.first + 1} "
        f"({_at(column, int(row))})"
        for row, n in zip(rows[:SHOWN_PLACES], samples[:SHOWN_PLACES], strict=True)
    ]
    return ", ".join(shown) + _more(len(rows))


def _at(column: ClockColumn, row: int) -> str:
    return f"{float(column.read(row, row + 1)[0]):.6g} s from the first"


def _more(count: int) -> str:
    return f" and {count - SHOWN_PLACES} more" if count > SHOWN_PLACES else ""


def _require_uniform(name: str, rows: KeptRows, mean: MeanRate, description: ImportDescription) -> None:
    """Raises `UnfitRecording` where a stretch has another rate than the whole."""
    if mean.off <= 1.0:
        return
    begin, samples, duration, allowed = mean.worst
    row = int(rows.row(np.array([begin]))[0]) + description.rows.first
    raise UnfitRecording(
        f"{name}: the rate is not uniform: rows {row} to {row + samples} take {duration:.6g} s where "
        f"{samples / mean.rate_hz:.6g} s ± {100.0 * allowed:.2g} % are expected at the mean rate of "
        f"{mean.rate_hz:.6g} Hz; give a range that has one rate (rows), or a larger rate_tolerance"
    )


def _counted(
    column: ClockColumn,
    description: ImportDescription,
    repeats: NDArray[np.int64],
    rows: NDArray[np.int64],
    mean: MeanRate,
) -> list[str]:
    """Sentences on rows that were left out, gaps that were marked and wraps that were carried on."""
    found: list[str] = []
    if len(repeats):
        found.append(f"{_said_repeats(column, description, repeats)}; they were left out")
    if mean.places.lost:
        found.append(f"{_said_losses(column, description, rows, mean)}; NaN stands in their place")
    if len(mean.places.late):
        found.append(
            f"stamps are late or early in {len(mean.places.late)} place{'s' if len(mean.places.late) > 1 else ''}, the most "
            f"by {int(mean.places.late.max())} sample periods (first in row "
            f"{int(mean.places.late_rows[0]) + description.rows.first + 1}), with no sample lost"
        )
    if column.wraps:
        first = column.wraps[0]
        found.append(
            f"the clock wrapped at {first.wrap} {len(column.wraps)} time{'s' if len(column.wraps) > 1 else ''}, first: "
            f"{_fall(first, column, description)}; it was carried on"
        )
    return found


def _arrival(pattern: Pattern, mean: MeanRate, resolution_s: float) -> list[str]:
    """Sentences on stamps that are those of arrival."""
    lost = "no sample is lost" if not mean.places.lost else "what is lost is said apart"
    if pattern.batch > 1:
        return [
            f"arrival in batches: the stamps are those of arrival, {pattern.batch} rows at a time; {lost}, and the rate "
            f"of {mean.rate_hz:.6g} Hz is that from batch to batch"
        ]
    if pattern.kind == "jitter":
        return [
            f"the stamps jitter by {pattern.band_s * mean.rate_hz:.2g} sample periods, as stamps of arrival do; {lost}, "
            f"and the rate of {mean.rate_hz:.6g} Hz is the mean one"
        ]
    if pattern.kind == "coarse" and resolution_s * mean.rate_hz > 1.01:
        return [
            f"several rows share a stamp: the clock's resolution of {resolution_s:.3g} s is coarser than the sample "
            f"period of {1.0 / mean.rate_hz:.3g} s; {lost}"
        ]
    return []


def _printing(finest_s: float, coarsest_s: float, mean: MeanRate) -> list[str]:
    """A sentence where the stamps lose digits as they grow, so many that it matters."""
    if coarsest_s * mean.rate_hz < 0.05:
        return []
    return [
        f"the time column lost digits in printing: its resolution goes from {finest_s:.1g} s to {coarsest_s:.1g} s, the "
        f"sample period is {1.0 / mean.rate_hz:.3g} s"
    ]


def _require_declared(name: str, rate_hz: float, description: ImportDescription) -> None:
    """Raises `BadParameter` where the declared rate is another one."""
    declared = description.rate_hz
    if declared is None or abs(rate_hz / declared - 1.0) <= description.rate_tolerance:
        return
    factor = rate_hz / declared
    guess = ""
    for size in (1e3, 1e6, 1e9):
        if abs(factor / size - 1.0) < 0.01 or abs(factor * size - 1.0) < 0.01:
            guess = f", a factor of {size:g}: is {description.time_unit} the unit of the time column?"
    raise BadParameter("rate_hz", declared, f"the time column of {name} says {rate_hz:.6g} Hz{guess}")


def _rate_doubts(
    rate_hz: float,
    column: ClockColumn,
    description: ImportDescription,
    column_name: str,
    pattern: Pattern,
    resolution_s: float,
) -> Sequence[str]:
    """Sentences on a rate that is off the declared one, unlikely, or of another unit than the column's name has."""
    found: list[str] = []
    declared, unit = description.rate_hz, description.time_unit
    if declared is not None:
        allowed = max(
            CRYSTAL,
            2.0
            * (resolution_s + (0.0 if pattern.kind in ("steady", "coarse") else pattern.band_s))
            / column.duration_s,
        )
        off = rate_hz / declared - 1.0
        if allowed < abs(off) <= description.rate_tolerance:
            found.append(
                f"the time column says {rate_hz:.6g} Hz, {100.0 * off:+.2g} % off the declared {declared:g} Hz, which is "
                f"used; its clock allows {100.0 * allowed:.2g} %"
            )
    named = _NAMED_UNIT.search(column_name)
    name_unit = _SPELLED.get(named.group(1)[0].lower()) if named else None
    if unit in SECONDS and name_unit is not None and name_unit != unit:
        as_named = rate_hz * SECONDS[unit] / SECONDS[name_unit]
        found.append(
            f"the time column's name {column_name!r} says {name_unit}, the description {unit}: {rate_hz:.6g} Hz would be "
            f"{as_named:.6g} Hz"
        )
    inertial = any(c.channel().quantity is not Quantity.TEMPERATURE for c in description.channels)
    if inertial and declared is None and not SLOWEST_HZ <= rate_hz <= FASTEST_HZ:
        likely = [
            f"{rate_hz * column.scale_s / size:.6g} Hz if the column is in {other}"
            for other, size in SECONDS.items()
            if SLOWEST_HZ <= rate_hz * column.scale_s / size <= FASTEST_HZ and unit in SECONDS and other != unit
        ]
        guess = f" ({' or '.join(likely)})" if likely else ""
        found.append(f"{rate_hz:.6g} Hz is an unlikely rate of an inertial unit: is the unit of time right?{guess}")
    return found
