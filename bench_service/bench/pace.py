"""Pace of a unit's samples over wires by the bench's clock, from the moments at which blocks of a recording come."""

from collections import deque
from collections.abc import Sequence
from statistics import median

from procedures.core.measured import MeasuredPace

ENDS = 16
"""Number of blocks at each end of a recording that are compared."""
LEAST = 8
"""Least number of blocks of a recording whose pace is measured."""


class PaceLog:
    """Lags of a recording's blocks: bench time at which each came, less the time of its last sample.

    What holds a block up makes its lag longer, and the next one short again: the least lags of the first and of the
    last blocks are compared. Samples that come slower than their declared rate never make it up.
    """

    def __init__(self, start_s: float) -> None:
        """Set up; `start_s`: bench time of the recording's beginning [s]."""
        self._start_s = start_s
        self._first: list[float] = []
        self._last: deque[float] = deque(maxlen=ENDS)
        self._blocks = 0

    def block(self, now_s: float, samples_s: float) -> None:
        """A block has come: bench time now, and time of all samples so far [s]."""
        lag_s = now_s - self._start_s - samples_s
        self._blocks += 1
        if len(self._first) < ENDS:
            self._first.append(lag_s)
        self._last.append(lag_s)

    def measured(self) -> MeasuredPace | None:
        """Return the pace of the whole recording; None where its blocks are too few."""
        if self._blocks < LEAST:
            return None
        half = min(ENDS, self._blocks // 2)
        first, last = self._first[:half], list(self._last)[-half:]
        return MeasuredPace(min(last) - min(first), max(_scatter(first), _scatter(last)))


def _scatter(lags: Sequence[float]) -> float:
    return median(lags) - min(lags)
