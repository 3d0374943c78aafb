"""The mean rate of a time column, and whether each of its stretches has it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bench_service.formats.clock.column import ClockColumn, windows
from bench_service.formats.clock.levels import LEAST, Places, ahead_of, changes, in_order, without_slips
from bench_service.formats.clock.pattern import Pattern
from procedures.core.arrays import Array

STRETCH = 256
"""Number of steps whose mean is compared with that of all: jitter of a fifth of a step is 0.2 % of it."""
WINDOW = 1 << 18
"""Number of rows that are processed together."""
SLIPS = 0.4
"""Resolution in periods beyond which a clock that is a little fast or slow slips by a tick now and then."""
WHOLE = 0.9
"""Resolution in periods beyond which a slip looks like a lost sample."""
PAUSE = 8
"""Number of samples lost in one place beyond which the gap is a pause."""
MOST_RUNS = 1000
SAMPLES = 4
"""Number of windows from which the pattern is found."""


class KeptRows:
    """The stamps of a column without the rows that repeat the one before."""

    def __init__(self, column: ClockColumn, repeats: NDArray[np.int64]) -> None:
        self._column = column
        self._repeats = repeats
        self._kept_before = repeats - np.arange(len(repeats))
        self.count = column.count - len(repeats)

    def row(self, kept: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the rows of the table, from 0, of rows that are kept."""
        return kept + np.searchsorted(self._kept_before, kept, side="right")

    def read(self, start: int, stop: int) -> Array:
        """Return the stamps [s] of the kept rows start … stop − 1."""
        stop = min(stop, self.count)
        ends = self.row(np.array([start, stop - 1]))
        begin, end = int(ends[0]), int(ends[1]) + 1
        time_s = self._column.read(begin, end)
        inside = self._repeats[(self._repeats >= begin) & (self._repeats < end)]
        return np.delete(time_s, inside - begin) if len(inside) else time_s

    def sample(self) -> list[Array]:
        """Return stretches of stamps [s] from all over the column."""
        return [self.read(*window) for window in windows(self.count, WINDOW, SAMPLES)]


@dataclass
class _Walk:
    """Sums and marks that one pass over the rows collects."""

    rows: list[NDArray[np.int64]] = field(default_factory=list[NDArray[np.int64]])
    samples: list[NDArray[np.int64]] = field(default_factory=list[NDArray[np.int64]])
    ends: list[Array] = field(default_factory=list[Array])
    """Stamps at every `STRETCH`-th row."""
    means: list[Array] = field(default_factory=list[Array])
    first_batch: tuple[int, float] | None = None
    last_batch: tuple[int, float] | None = None


@dataclass(frozen=True)
class MeanRate:
    """The rate, where samples are lost, and the stretch that differs most from the mean rate."""

    rate_hz: float
    places: Places
    """Places of lost samples, counted in kept rows."""
    worst: tuple[int, int, float, float]
    """First kept row from 0, samples, duration [s], and what is allowed, relative."""
    off: float
    """Deviation of the worst stretch, in parts of what is allowed."""


def mean_rate(
    rows: KeptRows, pattern: Pattern, tolerances: tuple[float, float], resolutions_s: tuple[float, float]
) -> MeanRate:
    """Compute the mean rate, samples over time. At least two rows, not all of the same time.

    `tolerances` are of a step and of a rate, relative; `resolutions_s` the finest and the coarsest of the clock.
    """
    ahead = ahead_of(pattern.span)
    walk = _walked(rows, pattern, ahead, tolerances[0], resolutions_s)
    places = in_order(np.concatenate(walk.rows), np.concatenate(walk.samples), ahead)
    if resolutions_s[0] > SLIPS * pattern.period_s:
        places = without_slips(places)
    rate_hz = _rate(rows, pattern, walk, places)
    worst, off = _worst(rows, walk, places, rate_hz, tolerances[1], pattern.band_s, pattern.batch)
    return MeanRate(rate_hz, places, worst, off)


def _walked(
    rows: KeptRows, pattern: Pattern, ahead: int, tolerance: float, resolutions_s: tuple[float, float]
) -> _Walk:
    walk = _Walk()
    finest, coarsest = resolutions_s
    unsure = coarsest / pattern.period_s if coarsest > finest else 0.0
    ticks = finest / pattern.period_s
    if pattern.kind == "coarse":  # the level of rounded stamps beats by the resolution
        unsure = max(unsure, ticks + 0.05 - LEAST)
    if pattern.kind in ("coarse", "steady") and SLIPS < ticks < WHOLE:  # a slip by one tick is less than a period
        unsure = max(unsure, 1.1 * ticks - LEAST)
    tolerances = tolerance, unsure
    # Where rows come late as a rule, the last ones say nothing: none after them shows what is on time.
    on_time = pattern.kind == "steady" or (pattern.kind == "coarse" and 2.0 * coarsest < pattern.period_s)
    on_time = on_time or (pattern.kind == "jitter" and pattern.usual_band_s < LEAST * pattern.period_s)
    open_end = 0 if on_time else ahead
    for start in range(0, rows.count, WINDOW):
        time_s = rows.read(start, start + WINDOW + ahead + 1)
        stop = min(WINDOW, rows.count - start)
        known = min(stop, max(0, rows.count - start - open_end))
        found = changes(time_s, pattern.period_s, ahead, tolerances, known, start == 0 and pattern.kind == "steady")
        walk.rows.append(found.rows + start)
        walk.samples.append(found.samples)
        walk.ends.append(time_s[:stop:STRETCH].copy())
        if pattern.batch > 1:
            begins = np.flatnonzero(np.diff(time_s[: stop + 1]) > 1.25 * pattern.period_s) + 1
            if len(begins):
                walk.first_batch = walk.first_batch or (start + int(begins[0]), float(time_s[begins[0]]))
                walk.last_batch = (start + int(begins[-1]), float(time_s[begins[-1]]))
        elif pattern.kind == "jitter":
            walk.means.append(_means(time_s[:stop], stretch_of(rows.count)))
    return walk


def stretch_of(count: int) -> int:
    """Return the number of rows whose mean stamp is one point of the regression: fewer in a short column."""
    return STRETCH if count >= 16 * STRETCH else max(1, count // 32)


def _means(time_s: Array, stretch: int) -> Array:
    """Compute the mean stamp of each whole stretch."""
    whole = len(time_s) // stretch
    return time_s[: whole * stretch].reshape(whole, stretch).mean(axis=1)


def _pauses(rows: KeptRows, places: Places) -> tuple[NDArray[np.int64], Array]:
    """Rows before long gaps, from 0, and the durations of those steps [s]: a pause is not a whole number of periods."""
    long = places.rows[places.samples > PAUSE]
    durations = [np.empty(0)]
    for start in range(0, rows.count, WINDOW) if len(long) else ():
        inside = long[(long >= start) & (long < start + WINDOW)]
        if len(inside):
            durations.append(np.diff(rows.read(start, start + WINDOW + 1))[inside - start])
    return long, np.concatenate(durations)


def _rate(rows: KeptRows, pattern: Pattern, walk: _Walk, places: Places) -> float:
    """From batch to batch where rows come in batches, by regression where they jitter, else from first to last stamp.

    Lost samples are counted in, pauses are left out.
    """
    if walk.first_batch and walk.last_batch and walk.last_batch[0] > walk.first_batch[0]:
        (begin, begin_s), (end, end_s) = walk.first_batch, walk.last_batch
        lost = places.before(np.array([begin, end]))
        return max(1, end - begin + int(lost[1] - lost[0])) / (end_s - begin_s)
    pauses, durations = _pauses(rows, places)
    means = np.concatenate(walk.means) if walk.means else np.empty(0)
    if len(means) >= 8:
        return _slope(means, places, pauses, stretch_of(rows.count))
    last = rows.count - 1
    first_s, last_s = float(rows.read(0, 1)[0]), float(rows.read(last, last + 1)[0])
    paused = int(places.samples[places.samples > PAUSE].sum())
    steps = last + int(places.samples.sum()) - paused - len(pauses)
    duration = last_s - first_s - float(durations.sum())
    return steps / duration if steps > 0 and duration > 0.0 else 1.0 / pattern.period_s


def _slope(means: Array, places: Places, pauses: NDArray[np.int64], stretch: int) -> float:
    """Samples a second by least squares over the means of stretches, each run between pauses with its own beginning."""
    begin = stretch * np.arange(len(means))
    k = begin + 0.5 * (stretch - 1) + places.before(begin)
    run = np.searchsorted(pauses, begin, side="left")
    whole = run == np.searchsorted(pauses, begin + stretch - 1, side="left")  # not across a pause
    above = below = 0.0
    for number in np.unique(run[whole])[:MOST_RUNS]:
        inside = whole & (run == number)
        centred_k, centred_t = k[inside] - k[inside].mean(), means[inside] - means[inside].mean()
        above += float(centred_k @ centred_k)
        below += float(centred_k @ centred_t)
    return above / below if below > 0.0 else float(k[-1] - k[0]) / float(means[-1] - means[0])


def _worst(
    rows: KeptRows,
    walk: _Walk,
    places: Places,
    rate_hz: float,
    allowed: float,
    jitter_s: float,
    batch: int,
) -> tuple[tuple[int, int, float, float], float]:
    """Find the stretch whose mean rate differs most from that of all, in parts of the allowed difference."""
    group = max(1, batch // 4)
    last = rows.count - 1
    marks = np.arange(0, rows.count, STRETCH)[::group]
    times = np.concatenate(walk.ends)[::group]
    if marks[-1] != last:
        marks, times = np.append(marks, last), np.append(times, rows.read(last, last + 1))
    samples = np.diff(marks + places.before(marks))
    durations = np.diff(times)
    late = np.zeros(len(durations))
    for row, periods in zip(places.late_rows[:MOST_RUNS], places.late[:MOST_RUNS], strict=True):
        touched = np.flatnonzero((marks[:-1] <= row + ahead_of(batch) + 2 * periods) & (marks[1:] >= row))
        late[touched] = np.maximum(late[touched], float(periods + ahead_of(batch)))
    bounds = allowed + (jitter_s * rate_hz + late) / np.maximum(samples, 1)
    off = np.abs(durations * rate_hz / np.maximum(samples, 1) - 1.0) / bounds
    at = int(np.argmax(off))
    return (int(marks[at]), int(samples[at]), float(durations[at]), float(bounds[at])), float(off[at])
