"""Places where rows are lost: from there on all stamps lie behind by whole periods."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from procedures.core.arrays import Array

AHEAD = 64
"""Rows that are looked ahead for one that is on time."""
LEAST = 0.45
"""Smallest change of the level that is looked at, in periods."""
EARLY = 8
"""Rows within which a level that fell is back again where single stamps are early."""
EVEN = 0.1
"""Part of their mean by which the distances of slips may differ."""
MOST_LOST = 1e12
"""Largest number of lost samples in one place: the number from a nonsensical stamp is clipped to it."""
MADE_UP_FOR = 10_000
"""Number of falls of the level above which they are not compared with the rises before them: such a clock is
useless."""


@dataclass(frozen=True)
class Places:
    """Steps at which the count of samples and the count of rows part, in the order of the rows."""

    rows: NDArray[np.int64]
    """The row before the step, from 0."""
    samples: NDArray[np.int64]
    """Number of samples lost at each place; negative: rows more than the time has room for."""
    late_rows: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    """The row before each stretch of rows whose stamps are late or early, without lost samples."""
    late: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    """Number of periods by which they are off."""

    @property
    def lost(self) -> int:
        """Total number of lost samples."""
        return int(self.samples[self.samples > 0].sum())

    @property
    def surplus(self) -> int:
        """Total number of rows for which the time has no room."""
        return int(-self.samples[self.samples < 0].sum())

    def before(self, rows: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the number of samples that are lost before each of some rows, (k,)."""
        total = np.concatenate([[0], np.cumsum(self.samples)])
        return total[np.searchsorted(self.rows, rows, side="left")]


def ahead_of(span: int) -> int:
    """Return the number of rows to look ahead, a power of two: several batches, so that each window has a row that is
    on time.
    """
    return AHEAD if span <= AHEAD // 4 else 1 << int(np.ceil(np.log2(4 * min(span, 1 << 16))))


def level(late: Array, ahead: int) -> Array:
    """Return the smallest of the next `ahead` values (a power of two), for every row: arrivals are late, never
    early.
    """
    found, reach = late.copy(), 1
    while reach < min(ahead, len(late)):
        found[:-reach] = np.minimum(found[:-reach], found[reach:])
        reach *= 2
    return found


def changes(
    time_s: Array, period_s: float, ahead: int, tolerances: tuple[float, float], stop: int, begins: bool
) -> Places:
    """Rises and falls of the level of ``t_i − i·P`` by half a period and more at the steps before row `stop`.

    `time_s` has shape (n,) and may continue beyond `stop`, to be looked at ahead. `tolerances`: of a step that is never
    looked at, and of the level beyond half a period, both in periods. `begins`: the first row is the first of all, and
    on time.
    """
    tolerance, least = tolerances[0], LEAST + tolerances[1]
    steps = np.diff(time_s)
    if not len(steps) or bool(np.all(np.abs(steps - period_s) <= tolerance * period_s)):
        return Places(np.empty(0, np.int64), np.empty(0, np.int64))
    late = time_s - period_s * np.arange(len(time_s))
    before = ahead - 1 if begins else 0  # rows on time before the first, from which a fall can be seen
    late = np.concatenate([np.full(before, late[0]), late])
    rise = np.clip(np.diff(level(late, ahead))[: before + stop] / period_s, -MOST_LOST, MOST_LOST)
    up, down = np.flatnonzero(rise >= least), np.flatnonzero(rise <= -least)
    # The level falls as soon as the fall is within sight: its place is at the far end of the window.
    begins_run = np.flatnonzero(np.diff(down, prepend=-2) > 1)  # rows that make up for a delay fall one by one
    fallen = np.add.reduceat(rise[down], begins_run) if len(down) else np.empty(0)
    rows = np.concatenate([up, np.minimum(down[begins_run] + ahead - 1, before + len(steps) - 1)]) - before
    samples = np.concatenate([np.maximum(1, np.rint(rise[up])), np.minimum(-1, np.rint(fallen))]).astype(np.int64)
    return Places(rows.astype(np.int64), samples)


def in_order(rows: NDArray[np.int64], samples: NDArray[np.int64], ahead: int) -> Places:
    """Return the places in the order of their rows, without rises and falls that make up for one another."""
    order = np.argsort(rows, kind="stable")
    rows, samples = rows[order], samples[order]
    left = samples.copy()
    rises: list[int] = []
    for at in range(len(left)) if np.count_nonzero(left < 0) <= MADE_UP_FOR else ():
        if left[at] > 0:
            if at and rows[at] - rows[at - 1] <= EARLY:
                _make_up(left, at - 1, at)
            rises.append(at)
        while left[at] < 0 and rises and rows[at] - rows[rises[-1]] <= ahead + 2 * samples[rises[-1]]:
            _make_up(left, at, rises[-1])
            if not left[rises[-1]]:
                rises.pop()
    kept, late = left != 0, (samples > 0) & (left != samples)
    return Places(rows[kept], left[kept], rows[late], (samples - left)[late])


def without_slips(places: Places) -> Places:
    """Return the places without those of a coarse clock a little off its rate: where each is one sample lost, or each
    one too many, at equal distances, none is left; else all are as they were.
    """
    apart = np.diff(places.rows)
    if len(apart) < 2 or np.any(places.samples != places.samples[0]) or abs(int(places.samples[0])) != 1:
        return places
    if np.ptp(apart) > max(2.0, EVEN * float(np.mean(apart))):
        return places
    none = np.empty(0, np.int64)
    return Places(none, none, places.late_rows, places.late)


def _make_up(left: NDArray[np.int64], fall: int, rise: int) -> None:
    """Take from a rise what a fall makes up for, in place."""
    paid = max(0, min(int(left[rise]), -int(left[fall])))
    left[rise] -= paid
    left[fall] += paid
