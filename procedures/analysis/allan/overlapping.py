"""The sums of the overlapping members term by term, from pieces of any length, with or without gaps.

A series of up to `WHOLE` samples is exact at every size. A longer one, which `correlated` does faster where it can, is
taken at two resolutions: cluster sizes up to `exact_limit` use every start k, larger ones the running sum at every
s-th sample only. Each cluster mean is still exact, but the starts are 0, s, 2s… (4s, beyond `LONG`·s), and the cluster
sizes multiples of that. The loss depends on the noise. Where the rate is white or redder neighbouring starts
hardly differ: below 0.01 %. Where white angle noise still dominates there, every start counts:
``1/√(2·POINTS·18/35)`` ≈ 0.1 %, one sigma.
"""

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.allan.differences import BLOCK, sum_of_smoothed_squares, sum_of_squares
from procedures.analysis.allan.identification import Held, LatePoints
from procedures.analysis.allan.integral import Counts, Piece
from procedures.analysis.allan.statistic import Sizes, Statistic
from procedures.core.arrays import Array

WHOLE = 1 << 21
"""A series up to this length is held and differenced whole."""
POINTS = 1 << 20
"""Fewest points held of a longer series."""
LONG = 1 << 14
"""Size, in held points, from which on every fourth point is a start."""
SMOOTH = 16
"""Starts per cluster of a modified statistic that are as good as all, since it is smooth over its cluster."""


def stride_of(count: int) -> int:
    """Return the step s of the held points, a power of two; 1 where the series is held whole."""
    return 1 if count <= WHOLE else 1 << int(np.log2(count / POINTS))


def exact_limit(statistic: Statistic, count: int) -> int:
    """Return the largest cluster size that uses every start."""
    if count <= WHOLE or not statistic.overlapping:
        return count
    near = BLOCK // statistic.differences
    return min(near, SMOOTH * stride_of(count)) if statistic.modified else near


def strides_of(sizes: Sizes, statistic: Statistic, count: int) -> Sizes:
    """Return the distances between the starts of successive terms at each cluster size [samples], (k,).

    1, every start, for a series held whole, a statistic without overlap, and sizes up to `exact_limit`; above it the
    step s of the held points (`stride_of`), and 4s for sizes of `LONG`·s samples and more. `count`: samples of the
    series.
    """
    s = stride_of(count)
    if s == 1 or not statistic.overlapping:
        return np.ones(len(sizes), np.int64)
    longest = np.where((sizes >= LONG * s) & (not statistic.modified), 4 * s, s)
    return np.where(sizes <= exact_limit(statistic, count), 1, longest)


def snapped_sizes(sizes: Sizes, statistic: Statistic, count: int) -> Sizes:
    """Return the sizes at which the sums will be computed, ascending, each once: multiples of the distances of their
    starts (`strides_of`).
    """
    s = strides_of(sizes, statistic, count)
    return np.unique(np.minimum(np.round(sizes / s).astype(np.int64), statistic.largest(count) // s) * s)


class _Points:
    """The running sum at every s-th sample; of a modified statistic, its sums over s samples."""

    def __init__(self, count: int, stride: int, *, summed: bool) -> None:
        self._stride, self._summed = stride, summed
        self.x = np.zeros((count + 1) // stride if summed else count // stride + 1)
        self.missing: Counts | None = None
        self._index, self._carry = 0, np.empty(0)

    def add(self, piece: Piece) -> None:
        s, first = self._stride, -self._index % self._stride
        at = (self._index + first) // s
        if self._summed and s > 1:
            z = np.concatenate([self._carry, piece.x])
            whole = len(z) // s * s
            kept, done = z[:whole].reshape(-1, s).sum(axis=1), (self._index - len(self._carry)) // s
            self.x[done : done + len(kept)] = kept
            self._carry = z[whole:]
        else:
            kept = piece.x[first::s]
            self.x[at : at + len(kept)] = kept
        if piece.missing is not None:
            if self.missing is None:
                self.missing = np.zeros(len(self.x) + 1, np.int64)
            gaps = piece.missing[first::s][: len(self.missing) - at]
            self.missing[at : at + len(gaps)] = gaps
            self.missing[at + len(gaps) :] = piece.missing[-1]
        self._index += len(piece.x)


class OverlappingSums:
    """Sums of squared differences of an overlapping statistic at many cluster sizes, term by term, with or without
    gaps.
    """

    def __init__(self, statistic: Statistic, count: int, sizes: Sizes) -> None:
        self._statistic, self._count = statistic, count
        self._stride = stride_of(count)
        self.sizes = snapped_sizes(sizes, statistic, count)
        self.strides = strides_of(self.sizes, statistic, count)
        self._near = self.sizes[self.strides < self._stride]
        self._sums, self._terms = np.zeros(len(self.sizes)), np.zeros(len(self.sizes), np.int64)
        self._points = _Points(count, self._stride, summed=statistic.modified)
        self._rest, self._rest_gaps = np.empty(0), None
        self._late = LatePoints(count)
        self._take(Piece(np.zeros(1), None))

    def add(self, piece: Piece) -> None:
        """Add the next piece of the running sum."""
        self._late.add(piece)
        self._take(piece)

    def _take(self, piece: Piece) -> None:
        self._points.add(piece)
        if not len(self._near):
            return
        if piece.missing is not None or self._rest_gaps is not None:
            old = np.zeros(len(self._rest), np.int64) if self._rest_gaps is None else self._rest_gaps
            new = np.zeros(len(piece.x), np.int64) if piece.missing is None else piece.missing
            self._rest_gaps = np.concatenate([old, new])
        self._rest = np.concatenate([self._rest, piece.x])
        done = 0
        while len(self._rest) - done >= 2 * BLOCK:
            self._difference(slice(done, done + 2 * BLOCK), BLOCK)
            done += BLOCK
        self._rest = self._rest[done:]
        self._rest_gaps = None if self._rest_gaps is None else self._rest_gaps[done:]

    def _difference(self, window: slice, starts: int | None) -> None:
        """Adds the terms that begin in a window of x: the first `starts` of them, or all that fit."""
        x = self._rest[window]
        gaps = None if self._rest_gaps is None else self._rest_gaps[window]
        for i, size in enumerate(self._near):
            total, terms = self._sum(x, gaps, int(size), starts, summed=False)
            self._sums[i] += total
            self._terms[i] += terms

    def _sum(self, x: Array, missing: Counts | None, m: int, starts: int | None, *, summed: bool) -> tuple[float, int]:
        p = self._statistic.differences
        stop = max(0, len(x) - p * m + self._statistic.modified) if starts is None else starts
        if self._statistic.modified:
            return sum_of_smoothed_squares(x, missing, m, 3 * m - (not summed), stop)
        return sum_of_squares(x, missing, m, p, stop)

    def finish(self) -> tuple[Array, NDArray[np.int64]]:
        """Sums of squared differences and their term counts, (k,) each, at `self.sizes`. Call once, after the last
        piece.
        """
        if len(self._near):
            self._difference(slice(None), None)
        points, gaps = self._points.x, self._points.missing
        held = {f: (points[::f].copy(), None if gaps is None else gaps[::f].copy()) for f in (1, 4)}
        for i in range(len(self._near), len(self.sizes)):
            step = int(self.strides[i]) // self._stride
            m = int(self.sizes[i]) // int(self.strides[i])
            x, missing = held[step]
            self._sums[i], self._terms[i] = self._sum(x, missing, m, None, summed=self._stride > 1)
        return self._sums, self._terms

    def held(self) -> Held:
        """Return the values of the running sum that the noise identification needs."""
        return self._late.held()

    def starts(self) -> NDArray[np.int64]:
        """Return the number of starts that fit, with or without gaps, (k,)."""
        whole = np.array([self._statistic.starts(self._count, int(m)) for m in self.sizes], np.int64)
        return (whole - 1) // self.strides + 1
