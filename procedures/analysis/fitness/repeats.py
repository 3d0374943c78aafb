"""Rows that are sent more than once: all channels repeat at once, more often than their noise allows."""

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.fitness.pieces import Mask

Counts = NDArray[np.int64]

HELD = 0.8
"""Share of the changed rows from which on channels change together, so that rows are held."""
HELD_SHARE = 0.01
"""Least share of repeated rows; fewer are left to the search for the longest run."""

SEVERAL = 5


class Repeats:
    """Counts of rows that repeat the previous row in all channels."""

    def __init__(self, channels: int) -> None:
        self.zeros = np.zeros(channels, np.int64)
        """Number of samples of each channel that repeat the previous one."""
        self.rows = 0
        self.pairs = 0
        self.first_index = 0

    def add(self, same: Mask, zeros: Counts, start: int) -> None:
        """Take in the mask of repeats of the previous sample, (channels, n), their number by channel, and their
        start.
        """
        count = same.shape[1]
        rows: Mask = np.logical_and.reduce(same, axis=0)
        repeated = int(np.count_nonzero(rows))
        if repeated and not self.rows:
            self.first_index = start + int(np.argmax(rows))
        self.zeros += zeros
        self.rows += repeated
        self.pairs += count

    def held(self, in_runs: int, fine: NDArray[np.bool_]) -> list[int]:
        """Return the channels that show by changing only together that rows are sent more than once; none, if they do
        not.

        `in_runs`: repeated rows in long runs, which are judged elsewhere. `fine` (channels,): those that change
        by more than a step or two; of others `SEVERAL` must agree, since a common cause of a few of them, a current or
        a reference, changes them together.
        """
        if self.rows - in_runs < max(20, HELD_SHARE * self.pairs) or self.rows == self.pairs:
            return []
        changed = (self.pairs - self.zeros) / (self.pairs - self.rows)
        together = np.flatnonzero(changed >= HELD)
        by_chance = float(np.prod(1.0 - changed[together]))
        enough = np.count_nonzero(fine[together]) > 1 or len(together) >= SEVERAL
        return together.tolist() if enough and self.rows > 5.0 * by_chance * self.pairs else []
