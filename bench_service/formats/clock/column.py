"""The stamps of a time column as they arrive: kept in seconds since the first, with their falls, wraps and repeats."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from tempfile import SpooledTemporaryFile

import numpy as np
from numpy.typing import NDArray

from bench_service.formats.clock.resolution import Resolution
from procedures.core.arrays import Array

IN_MEMORY_BYTES = 16 * 1024 * 1024
"""Size of the stamps in memory [bytes]; further ones go to an unnamed file."""
WRAPS_S = {
    "2^16 µs": 2.0**16 * 1e-6,
    "2^32 ns": 2.0**32 * 1e-9,
    "2^24 µs": 2.0**24 * 1e-6,
    "2^16 ms": 2.0**16 * 1e-3,
    "an hour": 3600.0,
    "2^32 µs": 2.0**32 * 1e-6,
    "a day": 86400.0,
    "2^32 ticks of 0.1 ms": 2.0**32 * 1e-4,
    "a week": 604800.0,
    "2^32 ms": 2.0**32 * 1e-3,
}
"""Periods after which counters and clocks begin again, shortest first [s]."""
WRAP_STEPS = 50.0
"""Largest step that may remain after a wrap, as a multiple of the usual step."""
REPEATS_KEPT = 4_000_000
FALLS_KEPT = 100
FALLS_LOOKED_AT = 20_000
"""Number of falls beyond which they are only counted, and none is taken as a wrap."""

Stamps = NDArray[np.int64] | Array


@dataclass(frozen=True)
class Fall:
    """A place where the time decreases: the row before it, counted from 1, and the stamps of that row and the next."""

    row: int
    before: int | float
    after: int | float
    wrap: str | None
    """Name of the period after which the clock began again; None: the fall is no wrap."""


@dataclass
class Standstill:
    """Longest run of rows with one stamp: its first row, from 0, its number of rows, and the step before it [s]."""

    row: int = 0
    rows: int = 1
    step_before_s: float = 0.0
    _row: int = 0
    _rows: int = 1
    _step_before_s: float = 0.0

    def add(self, steps: Array, still: NDArray[np.intp], row: int) -> None:
        """Add steps [s], those of length zero among them, and the row, from 0, that the first of them leads to."""
        if not len(steps):
            return
        if not len(still):  # of a clock that moves, only the last row can begin a run
            self._row, self._rows, self._step_before_s = row + len(steps) - 1, 1, float(steps[-1])
            return
        moving = np.flatnonzero(steps != 0.0)
        begins = np.concatenate([[self._row], row + moving])
        lengths = np.diff(np.concatenate([[row - self._rows], row + moving, [row + len(steps)]]))
        before = np.concatenate([[self._step_before_s], steps[moving]])
        longest = int(np.argmax(lengths))
        if lengths[longest] > self.rows:
            self.row, self.rows = int(begins[longest]), int(lengths[longest])
            self.step_before_s = float(before[longest])
        self._row, self._rows, self._step_before_s = int(begins[-1]), int(lengths[-1]), float(before[-1])


@dataclass
class ClockColumn:
    """The stamps of one file, kept in a temporary file. `scale_s`: seconds in one unit; `unwrap`: whether wraps of the
    counter are carried on.
    """

    scale_s: float
    unwrap: bool
    count: int = 0
    falls: list[Fall] = field(default_factory=list[Fall])
    """First falls of the column; those that were continued as wraps are in `wraps`."""
    fall_count: int = 0
    wraps: list[Fall] = field(default_factory=list[Fall])
    still: int = 0
    """Number of steps whose length is zero."""
    standstill: Standstill = field(default_factory=Standstill)
    resolution: Resolution = field(default_factory=Resolution)
    largest: float = 0.0
    """Largest stamp without its sign, in the column's unit."""
    first: int | float = 0
    typical_s: float | None = None
    same: int = 0
    """Number of rows whose channels equal those of the row before, whatever their time."""
    _carried_s: float = 0.0
    _last_s: float = 0.0
    _last_raw: int | float = 0
    _repeats: list[NDArray[np.int64]] = field(default_factory=list[NDArray[np.int64]])
    _repeat_count: int = 0
    _times: SpooledTemporaryFile[bytes] = field(default_factory=lambda: SpooledTemporaryFile(IN_MEMORY_BYTES))  # noqa: SIM115  closed by `close`

    def add(self, stamps: Stamps, same: NDArray[np.bool_]) -> None:
        """Add the next rows: stamps in the column's unit, and whether each row's channels repeat the last row's."""
        if not self.count:
            self.first = stamps[0].item()
        time_s = self._relative(stamps)
        known = np.concatenate([[self._last_s], time_s]) if self.count else time_s
        steps = np.diff(known)
        row = max(self.count, 1)
        if self.typical_s is None and np.any(steps > 0.0):
            self.typical_s = float(np.median(steps[steps > 0.0]))
        falls = np.flatnonzero(steps < 0.0)
        if len(falls):
            self._fall(falls, steps, stamps, row, time_s)
        still = np.flatnonzero(steps == 0.0)
        self.standstill.add(steps, still, row)
        if len(still):
            self.still += len(still)
            self._repeat(still, same if self.count else same[1:], row)
        self.same += int(np.count_nonzero(same))
        self.count += len(stamps)
        self._last_s, self._last_raw = float(time_s[-1]), stamps[-1].item()
        self._times.seek(0, 2)
        self._times.write(time_s.tobytes())

    def close(self) -> None:
        """Free the memory of the stamps; they cannot be read afterwards."""
        self._times.close()

    def _relative(self, stamps: Stamps) -> Array:
        """Seconds since the first stamp, wraps that were found already carried on."""
        low, high = float(np.min(stamps)), float(np.max(stamps))
        self.largest = max(self.largest, abs(low), abs(high))
        integral = stamps.dtype == np.int64 and isinstance(self.first, int) and self.largest < 2.0**61
        exact = stamps if integral else stamps.astype(np.float64)  # a difference of integers could be too large
        units = (exact - self.first).astype(np.float64)
        error = 0.0 if integral else float(np.spacing(self.largest))
        self.resolution.add(units + np.rint(self._carried_s / self.scale_s), error)
        return units * self.scale_s + self._carried_s

    def _fall(self, falls: NDArray[np.intp], steps: Array, stamps: Stamps, row: int, time_s: Array) -> None:
        """Record the falls of the stamps; continue those that are wraps where that is wanted, in place."""
        shift = len(steps) - len(time_s)  # −1 in the first block, whose first stamp has no step
        carried = np.zeros(len(time_s))
        looked_at = falls[: max(0, FALLS_LOOKED_AT - self.fall_count)]
        for at in looked_at:
            before = stamps[at - shift - 1].item() if at > shift else self._last_raw
            after = stamps[at - shift].item()
            wrap = self._wrap(float(steps[at]), before * self.scale_s, after * self.scale_s)
            fall = Fall(row + int(at), before, after, wrap)
            if wrap is not None and self.unwrap:
                self.wraps.append(fall)
                carried[at - shift] += WRAPS_S[wrap]
                continue
            self.fall_count += 1
            if len(self.falls) < FALLS_KEPT:
                self.falls.append(fall)
        self.fall_count += len(falls) - len(looked_at)
        time_s += np.cumsum(carried)
        self._carried_s += float(carried.sum())

    def _wrap(self, step_s: float, before_s: float, after_s: float) -> str | None:
        """The period that a fall is a beginning again of: both stamps lie in one, and hardly a step remains."""
        longest = WRAP_STEPS * (self.typical_s or 0.0)
        for name, period_s in WRAPS_S.items():
            unsigned = after_s >= 0.0 and before_s < period_s
            signed = after_s >= -0.5 * period_s and before_s < 0.5 * period_s
            if (unsigned or signed) and 0.0 <= step_s + period_s <= min(longest, 0.5 * period_s):
                return name
        return None

    def _repeat(self, still: NDArray[np.intp], same: NDArray[np.bool_], row: int) -> None:
        repeated = still[same[still]]
        self._repeat_count += len(repeated)
        if self._repeat_count <= REPEATS_KEPT and len(repeated):
            self._repeats.append(repeated + row)

    @property
    def repeats(self) -> NDArray[np.int64]:
        """Rows, from 0, that have the stamp and the values of the row before; none where there are millions."""
        if self._repeat_count > REPEATS_KEPT or not self._repeats:
            return np.empty(0, np.int64)
        return np.concatenate(self._repeats)

    def read(self, start: int, stop: int) -> Array:
        """Return the rows start … stop − 1 as seconds since the first stamp, (n,)."""
        self._times.seek(8 * start)
        return np.frombuffer(self._times.read(8 * (stop - start)), np.float64)

    @property
    def duration_s(self) -> float:
        """Time from the first stamp to the last [s]."""
        return self._last_s


def windows(count: int, length: int, most: int) -> Sequence[tuple[int, int]]:
    """Return at most `most` stretches (start, stop) of the given length, evenly over `count` rows."""
    whole = max(1, count // length)
    picked = np.unique(np.linspace(0, whole - 1, min(most, whole)).astype(int))
    return [(int(p) * length, min(count, int(p + 1) * length + 1)) for p in picked]
