"""Copied samples: a channel repeats the previous sample far more often than its own small changes allow.

Where a quantity is rounded to multiples of q and its changes are large relative to q, a change of zero is about as
likely as one of +q or −q. Many more repeats than changes of one step are artificial: a table of two rates filled by
copying, or a row sent more than once.
"""

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.fitness.pieces import Samples
from procedures.core.arrays import Array

COARSE = 3.0
"""Size, in steps, that half of the changes must exceed for the repeats to prove anything."""
TIMES = 3.0
"""Least repeats for each change of one step, where half a repeat is expected."""
LEAST = 50
LEAST_SHARE = 0.01
"""Least share of copies; fewer are left to the search for runs."""
DEAD_BAND = 0.9
"""Share of the repeats at one value from which on small values are cut off, not samples held."""
PART = 1024
"""Number of differences that are judged together."""
STRIDE = 17
"""Every n-th difference is examined, with another offset in each piece, so that every phase of copying occurs."""
FIRST = 4
"""First pieces, in which every difference is examined."""


class Copies:
    """Running counts of the repeats, the changes of one step, and the larger ones of every channel."""

    def __init__(self, channels: int) -> None:
        self.step = np.full(channels, np.inf)
        """The least change that was seen [raw], (channels,)."""
        self._same = np.zeros(channels, np.int64)
        self._one = np.zeros(channels, np.int64)
        self._large = np.zeros(channels, np.int64)
        self._proven = np.zeros(channels, np.int64)
        """Repeats in stretches whose changes rule out repeats by chance."""
        self._looked = 0
        self.at_one_value: dict[int, float] = {}
        """Value by column at which nearly all repeats of the first piece stand: a dead band's."""
        self._pieces = 0

    def add(self, d: Samples, resolution: Array) -> None:
        """Take in differences (channels, n); `resolution` [raw] of integer channels; 0 of others (least change)."""
        stride = 1 if self._pieces < FIRST else STRIDE
        some = np.abs(d[:, self._pieces % stride :: stride].astype(np.float64))
        self._pieces += 1
        if not some.shape[1]:
            return
        least = np.min(np.where(some > 0.0, some, np.inf), axis=1)
        self.step = np.where(resolution > 0.0, resolution, np.minimum(self.step, least))
        step = np.where(np.isfinite(self.step), self.step, 1.0)[:, None]
        self._looked += some.shape[1]
        parts = max(1, some.shape[1] // PART)
        for part in np.array_split(some, parts, axis=1):
            self._count(part, step)

    def note_values(self, x: Samples, same: NDArray[np.bool_]) -> None:
        """Take in the samples of the first piece, (channels, n), and the mask of those that repeat the one before."""
        for c, row in enumerate(same):
            held = x[c, x.shape[1] - len(row) :][row]
            if len(held) >= LEAST:
                middle = float(np.sort(held)[len(held) // 2])
                if np.count_nonzero(held == middle) > DEAD_BAND * len(held):
                    self.at_one_value[c] = middle

    def _count(self, some: Array, step: Array) -> None:
        """Count a stretch that is short enough for a channel's noise to be constant in it."""
        same = _counted(some == 0.0)
        one = _counted(some < 1.5 * step) - same
        large = _counted(some >= COARSE * step)
        self._same += same
        self._one += one
        self._large += large
        proves = (same > TIMES * one) & (large > 0.5 * (some.shape[1] - same))
        self._proven += np.where(proves, same, 0)

    def fine(self) -> NDArray[np.bool_]:
        """Return the mask of the channels, (channels,), most of whose changes exceed a few of their steps."""
        return self._large > 0.5 * (self._looked - self._same)

    def by_chance(self, c: int) -> float:
        """Return the share of samples that repeat the previous one by chance: half as many as change by one step."""
        return float(self._one[c]) / max(2 * self._looked, 1)

    def copied(self, in_runs: Array) -> list[int]:
        """Return the columns of the channels whose repeats are beyond what their changes allow.

        `in_runs`: part of all samples (channels,) that repeat in long runs, which are judged elsewhere.
        """
        many = self._proven - in_runs * self._looked > np.maximum(LEAST_SHARE * self._looked, LEAST)
        return np.flatnonzero(many & (self._proven > 0.5 * self._same)).tolist()


def _counted(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    return np.array([np.count_nonzero(row) for row in mask], np.int64)
