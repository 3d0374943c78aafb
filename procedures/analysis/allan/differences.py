"""Sums of squared differences of a running sum, and the sums of the non-overlapping members."""

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.allan.identification import Held, LatePoints
from procedures.analysis.allan.integral import Counts, Piece
from procedures.analysis.allan.statistic import Sizes, Statistic
from procedures.core.arrays import Array

BLOCK = 1 << 15
"""Terms per step; their memory fits into the cache."""

TOGETHER = 1 << 12
"""Points of a size that are differenced at once: a call costs as much as some thousands of them."""
_UNTHREADED = 1 << 13
"""Longest product of one thread; OpenBLAS runs longer ones in threads, a thousandfold cost on a busy machine."""


def squared(d: Array) -> float:
    """Return the sum of squares ``Σ d²`` of a vector, (n,)."""
    parts = (d[a : a + _UNTHREADED] for a in range(0, len(d), _UNTHREADED))
    return sum(float(np.dot(part, part)) for part in parts)


def sum_of_squares(z: Array, missing: Counts | None, m: int, order: int, stop: int) -> tuple[float, int]:
    """``Σ_{k<stop} (Δ_m^order z_k)²``, order 2 or 3, and its number of terms; a term that touches a gap is left out.

    `z` (n,) with ``stop − 1 + order·m < n``; `missing` (n,) counts the missing samples before each point.
    """
    total, terms = 0.0, 0
    first, second = np.empty(min(stop, BLOCK)), np.empty(min(stop, BLOCK))
    for a in range(0, stop, BLOCK):
        b = min(a + BLOCK, stop)
        d, e = first[: b - a], second[: b - a]
        if order == 2:
            np.subtract(z[a + 2 * m : b + 2 * m], z[a + m : b + m], out=d)
            np.subtract(z[a + m : b + m], z[a:b], out=e)
        else:
            np.subtract(z[a + 3 * m : b + 3 * m], z[a:b], out=d)
            np.subtract(z[a + 2 * m : b + 2 * m], z[a + m : b + m], out=e)
            e *= 3.0
        d -= e
        if missing is not None:
            touched = missing[a + order * m : b + order * m] != missing[a:b]
            d[touched] = 0.0
            terms -= int(np.count_nonzero(touched))
        total += squared(d)
        terms += b - a
    return total, terms


def sum_of_smoothed_squares(x: Array, missing: Counts | None, m: int, reach: int, stop: int) -> tuple[float, int]:
    """``Σ_{k<stop} (Σ_{i<m} Δ_m² x_{k+i})²`` and its number of terms: the modified Allan's, without a sum of sums.

    `x` (n,) with ``stop + 3m − 2 < n``; a term is left out where `missing` differs `reach` points on. Running sums
    restart with every stretch, so that they stay small.
    """
    total, terms = 0.0, 0
    stretch = max(BLOCK, 2 * m)
    for a in range(0, stop, stretch):
        b = min(a + stretch, stop)
        e = b + m - 1
        d = x[a + 2 * m : e + 2 * m] - x[a + m : e + m]
        d -= x[a + m : e + m] - x[a:e]
        np.cumsum(d, out=d)
        d[m:] -= d[:-m].copy()
        d = d[m - 1 :]
        if missing is not None:
            touched = missing[a + reach : b + reach] != missing[a:b]
            d[touched] = 0.0
            terms -= int(np.count_nonzero(touched))
        total += squared(d)
        terms += b - a
    return total, terms


class NonOverlappingSums:
    """Sums of squared differences of a non-overlapping statistic at many cluster sizes, each exact; memory for
    `TOGETHER` points a size at most.
    """

    def __init__(self, statistic: Statistic, count: int, sizes: Sizes) -> None:
        self._statistic, self._count, self.sizes = statistic, count, sizes
        self.strides = np.ones(len(sizes), np.int64)
        self._sums, self._terms = np.zeros(len(sizes)), np.zeros(len(sizes), np.int64)
        self._index = 1
        self._late = LatePoints(count)
        self._points = [[np.zeros(1)] for _ in sizes]
        self._gaps: list[list[Counts]] = [[] for _ in sizes]
        """Missing samples before the last of the points; nothing while there were none."""
        self._held = [1] * len(sizes)
        """Number of points of each size that wait for their differences."""

    def add(self, piece: Piece) -> None:
        """Add the next piece of the running sum."""
        self._late.add(piece)
        for i, size in enumerate(self.sizes.tolist()):
            points = piece.x[-self._index % size :: size]
            if not len(points):
                continue
            self._held[i] += len(points)
            whole = self._held[i] >= TOGETHER
            self._points[i].append(points if whole else points.copy())
            if piece.missing is not None:
                self._gaps[i].append(piece.missing[-self._index % size :: size].copy())
            if whole:
                self._difference(i)
        self._index += len(piece.x)

    def _difference(self, i: int) -> None:
        points, p = np.concatenate(self._points[i]), self._statistic.differences
        gaps = np.concatenate(self._gaps[i]) if self._gaps[i] else None
        if gaps is not None:
            gaps = np.concatenate([np.zeros(len(points) - len(gaps), np.int64), gaps])  # none before the first
            self._gaps[i] = [gaps[-p:]]
        if len(points) > p:
            total, terms = sum_of_squares(points, gaps, 1, p, len(points) - p)
            self._sums[i] += total
            self._terms[i] += terms
        self._points[i] = [points[-p:]]
        self._held[i] = len(self._points[i][0])

    def finish(self) -> tuple[Array, NDArray[np.int64]]:
        """Return the sums of squared differences and their term counts, (k,) each, at `self.sizes`. Call once, after
        the last piece.
        """
        for i in range(len(self.sizes)):
            self._difference(i)
        return self._sums, self._terms

    def held(self) -> Held:
        """Return the values of the running sum that the noise identification needs."""
        return self._late.held()

    def starts(self) -> NDArray[np.int64]:
        """Return the number of terms that fit, with or without gaps, (k,)."""
        return np.array([self._statistic.starts(self._count, int(m)) for m in self.sizes], np.int64)
