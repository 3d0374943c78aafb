"""Saturation of a channel: samples pile up at its largest or its smallest value."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.fitness.pieces import Mask, Samples
from procedures.core.arrays import Array
from procedures.importing import IMPORTING

NEIGHBOURS = 8
"""Levels that must exist in addition to the outermost one: a counter that reads −1, 0, 1 has no tail to cut off."""
STEEPEST = 2.5
"""Greatest ratio of the outermost level to its neighbours: more than the √2 + 1 of a sine wave's crest."""
ALONE = 0.4
"""Part of the samples of the outermost `NEIGHBOURS` + 1 levels that the first may hold: a sine's crest holds 1/3."""
CLIFF = 4.0
"""Ratio of the next level to those behind it from which on the noise is narrower than a level: no tail either."""
BUSY = 0.3
"""Share of exact repeats off the edge from which on the noise counts as narrow, too."""
CHANCE = 1e-10
"""Accepted probability of a false alarm at one edge."""
RAILS = frozenset((2**15 - 1, -(2**15), 2**16 - 1, 2**23 - 1, -(2**23), 2**24 - 1, 2**31 - 1, -(2**31)))
"""Ends of the range of converters of 16, 24 and 32 bits, signed and unsigned."""
FAR = 3.0
"""Ratio of the outermost level's distance from the next one to the span of all further levels, from which on it is no
part of the signal's range."""
ROUNDING = 1e-9
"""Difference of two levels relative to the largest value, below which they are one."""
FEW = 64
"""Counts that a piece may span to be sorted by counting."""

VERY_FEW = 12
"""Counts that a piece may span for one comparison each to be faster than that."""

Levels = tuple[Array, NDArray[np.int64]]


@dataclass
class Edge:
    """The outermost levels at one end of one channel. `sign` +1: the largest values; −1: the smallest."""

    sign: int
    levels: dict[float, int] = field(default_factory=dict[float, int])
    """Number of samples at each level, outermost first, at most `NEIGHBOURS` + 1 levels."""
    first_index: int = 0
    pairs: int = 0
    """Number of exact repeats at the outermost level."""

    @property
    def extreme(self) -> float:
        """The value of the outermost level."""
        return next(iter(self.levels))

    @property
    def count(self) -> int:
        """Number of samples at the outermost level."""
        return self.levels[self.extreme]

    @property
    def near(self) -> int:
        """Greatest number of samples at any of the next three levels."""
        return max(list(self.levels.values())[1:4], default=0)

    @property
    def is_far(self) -> bool:
        """True if the outermost level stands apart: farther from the next one than `FAR` times the span of the others
        that are kept.
        """
        levels = list(self.levels)
        return len(levels) > NEIGHBOURS and abs(levels[1] - levels[0]) > FAR * abs(levels[-1] - levels[1])

    def add(self, x: Samples, extreme: float, same: Mask, start: int, few: Levels | None) -> None:
        """Add samples (n,) from index `start`, with the outermost of them, `extreme`.

        `same`: mask of those that repeat the previous one, (n,) or (n − 1,); `few`: all their levels, where few.
        """
        full = len(self.levels) > NEIGHBOURS
        innermost = next(reversed(self.levels)) if self.levels else extreme
        if full and self.sign * extreme < self.sign * innermost:
            return
        at_extreme = x == extreme
        if not self.levels or self.sign * extreme > self.sign * self.extreme:
            self.first_index, self.pairs = start + int(np.argmax(at_extreme)), 0
        if few is None and full:
            x = x[x >= innermost] if self.sign > 0 else x[x <= innermost]
        self._merge(few or _sorted(x))
        if self.extreme == extreme:
            self.pairs += int(np.count_nonzero(at_extreme[len(at_extreme) - len(same) :] & same))

    def piles_up(self, repeats: int, count: int, other: "Edge") -> bool:
        """Return whether the outermost level holds more samples than a tail can, beyond chance.

        A tail does not rise outwards: of the n samples at the outermost level and the fullest of the next three the
        former holds at most ``STEEPEST/(1 + STEEPEST)``, and of all levels that are kept `ALONE`, binomial.
        `repeats`: exact repeats in the whole channel.
        """
        counts = self._apart(max(abs(self.extreme), abs(other.extreme)))
        if len(counts) <= NEIGHBOURS:
            return False
        outermost, next_one, *behind = counts[:4]
        inside = count - outermost - other.count
        if repeats - self.pairs - other.pairs > BUSY * inside or next_one > CLIFF * max(behind):
            return False
        steep = _at_least(outermost, outermost + self.near, STEEPEST / (1.0 + STEEPEST))
        alone = _at_least(outermost, sum(self.levels.values()), ALONE)
        return bool(min(steep, alone) < CHANCE)

    def _apart(self, size: float) -> list[int]:
        """Number of samples at each level; levels that differ by rounding alone, as pulses times their weight do, are
        counted as one.
        """
        levels, counts = list(self.levels), list(self.levels.values())
        parted = [abs(a - b) > ROUNDING * size for a, b in pairwise(levels)]
        if all(parted):
            return counts
        found = counts[:1]
        for is_new, count in zip(parted, counts[1:], strict=True):
            if is_new:
                found.append(count)
            else:
                found[-1] += count
        return found

    def _merge(self, found: Levels) -> None:
        """Merge ascending levels that are complete as far inward as the kept ones reach."""
        keep = slice(-NEIGHBOURS - 1, None) if self.sign > 0 else slice(NEIGHBOURS + 1)
        new = False
        for level, count in zip(found[0][keep].tolist(), found[1][keep].tolist(), strict=True):
            new = new or level not in self.levels
            self.levels[level] = self.levels.get(level, 0) + count
        if new:
            order = sorted(self.levels, reverse=self.sign > 0)
            self.levels = {level: self.levels[level] for level in order[: NEIGHBOURS + 1]}


def _at_least(k: int, n: int, p: float) -> float:
    """Probability of k ≥ 1 or more of n at probability p each: I_p(k, n − k + 1) (Abramowitz & Stegun 26.5.24)."""
    with IMPORTING:
        from scipy.special import betainc  # a service that starts does not wait for it

    return float(betainc(k, n - k + 1, p))


def counted(x: Samples, low: int, high: int) -> Levels | None:
    """Return all levels of integer samples (n,) between `low` and `high` with their counts; None unless they are
    few.
    """
    if high - low >= FEW:
        return None
    if high - low < VERY_FEW:
        counts = np.array([np.count_nonzero(x == np.int32(level)) for level in range(low, high + 1)], np.int64)
    else:
        counts = np.bincount(x - np.int32(low)).astype(np.int64)
    levels = np.flatnonzero(counts)
    return (levels + low).astype(np.float64), counts[levels]


def _sorted(x: Samples) -> Levels:
    levels, counts = np.unique(x, return_counts=True)
    return levels.astype(np.float64), counts.astype(np.int64)
