"""Judgement of a time column: its rate, lost and doubled rows, and which of that is refused or only a warning."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench_service.formats.clock.column import ClockColumn
from bench_service.formats.clock.doubts import clock_error_s, doubts, require_declared
from bench_service.formats.clock.pattern import find_pattern
from bench_service.formats.clock.rate import KeptRows, mean_rate
from bench_service.formats.clock.sentences import NO_TIME, Sentences, fall, others
from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from procedures.core.errors import UnfitRecording

LOST_DIGITS = 9.9
"""Ratio of the resolutions within one column that shows digits lost in printing."""
MOST_PLACES = 100
"""Number of gaps that are kept with the recording."""
STANDSTILL, SHORT_STANDSTILL = 10, 10
"""Length of a standstill in rows that usually share a stamp; a clock that hardly shares any counts as one of 10."""
BACKLOG = 0.4
"""Part of the duration of rows with one stamp that the step before them has where they had waited on their way."""
FEWEST_STAMPS, MOST_SHARED = 5, 16
"""Fewest different stamps of a column in which so many rows, on the average, share one."""
MOST_ROWS_OF_A_STAMP = 1 << 15
_UNPADDED = '; where milliseconds are written without leading zeros (31.18 for 31.018), ask for clock_fraction = "ms"'
_UNSORTED = f"; nothing is sorted: give the rows before or after it (rows), or {NO_TIME}"


@dataclass(frozen=True)
class ClockFindings:
    """Findings about a time column that was accepted: rate, repeated rows, gaps, lost samples, warnings."""

    rate_hz: float
    """Samples over time, lost ones included."""
    repeats: NDArray[np.int64]
    """Rows, from 0 in what is read, that are to be left out."""
    gaps: NDArray[np.int64]
    """Rows, from 0 in what is read, after which samples are lost."""
    lost: NDArray[np.int64]
    """Number of lost samples for each of `gaps`."""
    warnings: tuple[str, ...]
    document: dict[str, Any]
    """The findings as JSON, to be kept with the recording."""


def judge(name: str, column: ClockColumn, description: ImportDescription, column_name: str) -> ClockFindings:
    """Return the findings about the time column of a file. Raises `UnreadableFile`, `UnfitRecording`, `BadParameter`
    where it is refused, each with a way out.
    """
    if column.count < 2:
        raise UnreadableFile(name, "has fewer than two rows: no rate can be found in its time column")
    _require_growing(name, column, description)
    resolution_s, later_s = column.resolution.finest * column.scale_s, column.resolution.later * column.scale_s
    lost_digits = later_s >= LOST_DIGITS * resolution_s and not column.wraps
    found = _found(column, description, resolution_s, later_s if lost_digits else resolution_s)
    _require_whole(name, found)
    if found.mean.off > 1.0:
        raise UnfitRecording(f"{name}: {found.not_uniform()}")
    rate_hz = found.mean.rate_hz
    require_declared(name, rate_hz, description)
    warnings = [
        *found.done(),
        *found.arrival(resolution_s),
        *(found.lost_digits(resolution_s, later_s) if lost_digits else ()),
        *doubts(rate_hz, column, description, column_name, clock_error_s(found.pattern, resolution_s)),
    ]
    gaps, lost = found.gaps
    return ClockFindings(rate_hz, found.repeats, gaps, lost, tuple(warnings), _document(found, resolution_s))


def _found(column: ClockColumn, description: ImportDescription, finest_s: float, coarsest_s: float) -> Sentences:
    repeats = _repeats(column)
    kept = KeptRows(column, repeats)
    declared_s = None if description.rate_hz is None else 1.0 / description.rate_hz
    pattern = find_pattern(kept.sample(), finest_s, description.gap_tolerance, declared_s)
    tolerances = description.gap_tolerance, description.rate_tolerance
    mean = mean_rate(kept, pattern, tolerances, (finest_s, coarsest_s))
    return Sentences(column, description, repeats, kept, pattern, mean)


def _repeats(column: ClockColumn) -> NDArray[np.int64]:
    """Rows that were written twice: with one time, the same values, and equal values elsewhere the exception."""
    repeats = column.repeats
    moving = column.count - column.still
    elsewhere = column.same - len(repeats)
    if len(repeats) < 0.9 * column.still or column.still > 0.6 * column.count or elsewhere > 0.1 * moving:
        return np.empty(0, np.int64)
    return repeats


def _require_growing(name: str, column: ClockColumn, description: ImportDescription) -> None:
    """Check the order of the stamps. Raises `UnfitRecording` where the time falls, or never moves."""
    if column.fall_count:
        first, more = column.falls[0], others(column.fall_count - 1)
        where = fall(first, column, description)
        if first.wrap is not None:
            raise UnfitRecording(
                f"{name}: the clock wraps at {first.wrap}: {where}; unwrap_clock = true carries it on{more}"
            )
        unpadded = description.time_unit == "clock" and description.clock_fraction == "decimal"
        way = _UNPADDED if unpadded else _UNSORTED
        raise UnfitRecording(f"{name}: the time does not grow: {where}{more}{way}")
    if column.duration_s == 0.0:
        raise UnfitRecording(
            f"{name}: all {column.count} rows have the time {column.first!r}: digits were lost in printing, or it is "
            f"not a time; {NO_TIME}"
        )
    _require_moving(name, column, description)


def _require_moving(name: str, column: ClockColumn, description: ImportDescription) -> None:
    """Check that the clock shows a rate. Raises `UnfitRecording` where it stands still, or has only a few stamps.

    Rows that waited on their way share a stamp after a step as long as their wait; a clock that stands still has none.
    """
    stamps, still = column.count - column.still, column.standstill
    usual = (column.count - still.rows) / max(stamps - 1, 1)
    waited_s = BACKLOG * still.rows * column.duration_s / max(column.count - still.rows, 1)
    stands = still.rows >= STANDSTILL * max(usual, SHORT_STANDSTILL) and still.step_before_s < waited_s
    if stands and not len(_repeats(column)):
        first = still.row + description.rows.first
        last = first + still.rows - 1
        at = f"{float(column.read(still.row, still.row + 1)[0]):.6g} s from the first"
        ways = [f'rows = {{"first": {description.rows.first}, "last": {first}}} ends there'] if still.row else []
        ways += [f'rows = {{"first": {last}}} begins after it'] if still.row + still.rows < column.count else []
        raise UnfitRecording(
            f"{name}: the clock stands still: rows {first} to {last}, {still.rows} in a row, have one time, {at}. "
            f"Ways out: {'; '.join(ways)}; {NO_TIME} to take the rows as they follow"
        )
    shared = column.count / stamps
    if (stamps < FEWEST_STAMPS and shared >= MOST_SHARED) or shared > MOST_ROWS_OF_A_STAMP:
        raise UnfitRecording(
            f"{name}: {column.count} rows have only {stamps} different times, at least {FEWEST_STAMPS} are needed to "
            f"find a rate: digits were lost in printing, or it is not a time; {NO_TIME}"
        )


def _require_whole(name: str, found: Sentences) -> None:
    """Check for lost and doubled rows. Raises `UnfitRecording` with all of them, and the ways out."""
    problems: list[str] = []
    ways: list[str] = []
    if len(found.repeats) and found.description.repeats == "refuse":
        problems.append(found.repeated())
        ways.append('repeats = "drop" leaves the second of each out')
    if found.mean.places.lost and found.description.gaps == "refuse":
        problems.append(found.lost())
        ways += ['gaps = "mark" puts NaN in the place of each lost sample', *found.range_without_gaps()]
    if found.mean.places.surplus:
        problems.append(found.surplus())
        ways.append("the clock was set, or rows of two sources are mixed: give a range without it (rows)")
    if problems:
        ways.append(f"{NO_TIME} to take the rows as they follow")
        rate = f"{found.mean.rate_hz:.6g} Hz"
        raise UnfitRecording(f"{name}: at {rate} {'; '.join(problems)}. Ways out: {'; '.join(ways)}")


def _document(found: Sentences, resolution_s: float) -> dict[str, Any]:
    first, (gaps, lost) = found.description.rows.first, found.gaps
    return {
        "rate_hz": found.mean.rate_hz,
        "resolution_s": resolution_s,
        "arrival": found.pattern.kind,
        "rows_in_a_batch": found.pattern.batch,
        "repeated_rows": len(found.repeats),
        "lost_samples": found.mean.places.lost,
        "places": [
            {"after_row": int(row) + first, "lost": int(samples)}
            for row, samples in zip(gaps[:MOST_PLACES], lost[:MOST_PLACES], strict=True)
        ],
        "wraps": [{"after_row": w.row + first - 1, "period": w.wrap} for w in found.column.wraps[:MOST_PLACES]],
    }
