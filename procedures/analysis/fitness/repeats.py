"""A hung data link: whole rows that repeat one another exactly, for longer or more often than noise lets them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.fitness.pieces import Mask
from procedures.core.arrays import Array

Counts = NDArray[np.int64]

BUSY = 0.5
"""A channel bears witness where less than so large a part of its samples repeat the one before."""
CHANCE = 1e-9
"""Allowed of a false alarm of a recording."""
SURROUNDINGS = 256
"""Samples beside a run, at least, for its surroundings to be known."""
HELD = 0.8
"""All channels that change in so many of the changed rows change together: rows are held."""
HELD_SHARE = 0.01
"""Repeated rows below this part are left to the longest run."""


@dataclass(frozen=True)
class Run:
    """Rows that repeat the one before them, one after another."""

    first_index: int
    length: int
    local: Array
    """Part of repeats in each channel beside the run, (channels,)."""


class Repeats:
    """Rows that repeat the row before, over all channels."""

    def __init__(self, channels: int) -> None:
        self.zeros = np.zeros(channels, np.int64)
        """Samples of each channel that repeat the one before."""
        self.rows = 0
        self.pairs = 0
        self.first_index = 0
        self.longest: Run | None = None
        self._open = 0

    def add(self, same: Mask, missing: Mask | None, start: int) -> None:
        """Which samples repeat the one before, (channels, n), the first of them of index `start`."""
        count = same.shape[1]
        zeros = np.array([np.count_nonzero(row) for row in same], np.int64)
        rows: Mask = np.logical_and.reduce(same, axis=0)
        if missing is not None:
            rows &= ~missing[:, missing.shape[1] - count :].any(axis=0)
        repeated = int(np.count_nonzero(rows))
        if repeated and not self.rows:
            self.first_index = start + int(np.argmax(rows))
        if repeated or self._open:
            self._runs(rows, zeros, start)
        self.zeros += zeros
        self.rows += repeated
        self.pairs += count

    def finish(self) -> None:
        """No more rows: close a run that lasts to the end."""
        if self._open:
            self._keep(self.pairs + 1 - self._open, self._open, self.zeros - self._open, self.pairs - self._open)
            self._open = 0

    def hung(self) -> tuple[Run, list[int]] | None:
        """The longest run and the busy channels, where it is beyond chance.

        L independent repeats in channels whose part of repeats is p_c have the chance ``N·Π p_c^L``; p_c is the greater
        of that of the whole recording without the run and that beside the run. A channel of p_c > `BUSY` says nothing.
        """
        if self.longest is None:
            return None
        length, rest = self.longest.length, max(self.pairs - self.longest.length, 1)
        everywhere = (self.zeros - length + 1.0) / (rest + 1.0)
        part = np.maximum(everywhere, self.longest.local)
        busy = np.flatnonzero(part < BUSY)
        chance = np.log(max(self.pairs, 1)) + length * float(np.sum(np.log(np.clip(part[busy], 1e-3, 1.0))))
        return (self.longest, busy.tolist()) if len(busy) and chance < np.log(CHANCE) else None

    def held(self) -> list[int]:
        """The channels that show by changing only together that rows are sent more than once; none, if they do not."""
        if self.rows < max(20, HELD_SHARE * self.pairs) or self.rows == self.pairs:
            return []
        changed = (self.pairs - self.zeros) / (self.pairs - self.rows)
        together = np.flatnonzero(changed >= HELD)
        by_chance = float(np.prod(1.0 - changed[together]))
        return together.tolist() if len(together) > 1 and self.rows > 5.0 * by_chance * self.pairs else []

    def _runs(self, rows: Mask, zeros: Counts, start: int) -> None:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]]).astype(np.int8)))
        begins, ends = edges[::2], edges[1::2]
        lengths = ends - begins
        carried = self._open
        if carried:
            if len(begins) and begins[0] == 0:
                lengths[0] += carried
            else:
                self._keep(start - carried, carried, zeros, len(rows))
        self._open = 0
        if not len(lengths):
            return
        if ends[-1] == len(rows):
            self._open = int(lengths[-1])
            begins, ends, lengths = begins[:-1], ends[:-1], lengths[:-1]
        if len(lengths):
            best = int(np.argmax(lengths))
            inside = int(ends[best] - begins[best])
            first = start + int(ends[best]) - int(lengths[best])
            self._keep(first, int(lengths[best]), zeros - inside, len(rows) - inside)

    def _keep(self, first: int, length: int, zeros: Counts, beside: int) -> None:
        """A run that has ended, with the repeats among `beside` samples that are not of it."""
        if self.longest is None or length > self.longest.length:
            local = zeros / beside if beside >= SURROUNDINGS else np.zeros(len(zeros))
            self.longest = Run(first, length, local)
