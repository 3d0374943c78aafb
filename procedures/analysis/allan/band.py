"""The band of Allan deviations over every start (paper A).

A. A. Aviev, V. N. Enin, I. V. Saneev, "Experimental research of the dithering ring laser gyro triad by Allan variations
method", Science and Education of the Bauman MSTU, 2016, no. 6: the non-overlapping deviation of cluster size m depends
on where the first cluster starts. Taken over all m starts its mean depends on neither start nor step, and its minimum
and maximum show how far a single curve may lie from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, log2

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from procedures.analysis.allan.differences import squared
from procedures.analysis.allan.integral import Integral
from procedures.analysis.allan.statistic import ALLAN, Sizes, checked_sizes, decade_sizes
from procedures.core.arrays import Array

WHOLE = 1 << 21
"""A series up to this length is held whole, and every start of every size is used."""
POINTS = 1 << 20
"""Points held of a longer series (half as many at least), and about the number of terms of each smaller size."""
STARTS = 128
"""Least size, in held points, whose starts are the held points; smaller ones start at chosen samples, exactly."""
LONG, THIN = 1 << 11, 4
"""Sizes of at least `LONG` held points start at every `THIN`-th of them."""
_CHUNK = 1 << 18
_CACHED = 1 << 15


@dataclass(frozen=True)
class Band:
    """Least, mean and greatest non-overlapping deviation over the starts; arrays (k,), in the unit of the rate."""

    sizes: Sizes
    tau_s: Array
    least: Array
    mean: Array
    greatest: Array
    starts: NDArray[np.int64]
    """Start offsets taken; all of them where it equals the size (or all that fit)."""


class BandStream:
    """The band of one channel from blocks, for sizes with a step in decades; bounded memory (about 40 MB).

    Up to `WHOLE` samples the band is exact. Beyond, the offsets are thinned evenly: about `POINTS` squared differences
    remain at each size (of the smallest sizes twice as many, from every stretch of the record). The mean is then
    good to 0.1 %, and so are the extremes where the rate is white or redder, since neighbouring starts hardly differ.
    Under white angle noise, every start is an independent draw, and the extremes are those of the starts taken.
    Gaps are refused.
    """

    def __init__(
        self,
        rate_hz: float,
        count: int,
        *,
        step: float = 0.002,
        sizes: Sequence[int] | Sizes | None = None,
        increments: bool = False,
    ) -> None:
        self._rate_hz, self._count = rate_hz, count
        wanted = checked_sizes(decade_sizes(count // 2, step) if sizes is None else sizes, count, ALLAN)
        self._integral = Integral(rate_hz, increments=increments)
        self._stride = s = 1 if count <= WHOLE else 1 << ceil(log2(count / POINTS))
        self._near = [_Near(int(m), count) for m in wanted if s > 1 and m < STARTS * s]
        far = wanted[len(self._near) :]
        thin = np.where((far >= LONG * s) & (s > 1), THIN, 1)
        far = np.minimum(np.round(far / (thin * s)).astype(np.int64), count // (2 * s * thin)) * thin
        self._far = np.unique(far)
        self._points = np.zeros(count // s + 1)
        self._x = np.zeros(1)
        self._first, self._index = 0, 1
        self._waiting: list[Array] = []

    def add(self, block: Array | NDArray[np.int32]) -> None:
        """Add the next samples of the channel, (n,). Raises `UnfitRecording` for a gap or too many samples."""
        for piece in self._integral.add(block):
            first = -self._index % self._stride
            kept = piece.x[first :: self._stride]
            at = (self._index + first) // self._stride
            self._points[at : at + len(kept)] = kept
            self._index += len(piece.x)
            if self._near:
                self._waiting.append(piece.x)
                if sum(map(len, self._waiting)) >= _CHUNK:
                    self._take()

    def _take(self) -> None:
        self._x = np.concatenate([self._x, *self._waiting])
        self._waiting = []
        for near in self._near:
            near.add(self._x, self._first)
        kept = min(len(self._x), 3 * self._near[-1].m)
        self._first += len(self._x) - kept
        self._x = self._x[-kept:]

    def finish(self) -> Band:
        """Return the band. Call once, after the last sample. Raises `UnfitRecording` where samples are missing."""
        self._integral.check_end(self._count)
        rows: list[tuple[float, ...]] = []
        if self._near:
            self._take()
            rows += [_row(near.m, *near.finish(self._x, self._first)) for near in self._near]
            self._x = np.empty(0)
        thin = self._points[::THIN].copy()
        for size in self._far:
            m = int(size)
            if self._stride > 1 and m >= LONG and m % THIN == 0:
                sums, terms = start_sums(thin, m // THIN)
            else:
                sums, terms = start_sums(self._points, m)
            rows.append(_row(m * self._stride, sums, terms))
        table = np.array(rows)
        sizes = table[:, 0].astype(np.int64)
        return Band(sizes, sizes / self._rate_hz, table[:, 1], table[:, 2], table[:, 3], table[:, 4].astype(np.int64))


def _row(m: int, sums: Array, terms: Array) -> tuple[float, ...]:
    deviations = np.sqrt(sums / terms / 2.0) / m
    return m, float(deviations.min()), float(deviations.mean()), float(deviations.max()), len(deviations)


def start_sums(x: Array, m: int) -> tuple[Array, Array]:
    """Return ``Σ_j (Δ_m² x_{o+jm})²`` and its number of terms for each offset o, (min(m, starts),) each."""
    starts = len(x) - 2 * m
    offsets = min(m, starts)
    sums = np.zeros(offsets)
    rows = max(1, _CACHED // m)
    first, second = np.empty(max(_CACHED, rows * m)), np.empty(max(_CACHED, rows * m))
    a = 0
    while a < starts:
        b = min(a + rows * m, starts) if m <= _CACHED else min(a + _CACHED, (a // m + 1) * m, starts)
        d, e = first[: b - a], second[: b - a]
        np.subtract(x[a + 2 * m : b + 2 * m], x[a + m : b + m], out=d)
        np.subtract(x[a + m : b + m], x[a:b], out=e)
        d -= e
        d *= d
        whole, column = (b - a) // m * m, a % m
        if whole:
            sums += d[:whole].reshape(-1, m).sum(axis=0)
        sums[column : column + b - a - whole] += d[whole:]
        a = b
    return sums, np.asarray((starts - 1 - np.arange(offsets)) // m + 1, dtype=np.float64)


class _Near:
    """Sums of a small cluster size at some evenly spread offsets, from overlapping stretches of x."""

    def __init__(self, m: int, count: int) -> None:
        self.m = m
        self._offsets = max(1, min(m, POINTS * m // count))
        self._spread = m // self._offsets
        self._share = min(1.0, 2.0 * POINTS * m / count)
        self._sums, self._terms = np.zeros(self._offsets), 0
        self._row = 0

    def _add(self, x: Array, rows: int, columns: int) -> None:
        """Add the terms that start at the first `rows` clusters of `x`, at the first offsets."""
        step = x.strides[0]
        height = max(1, _CACHED // columns)
        for a in range(0, rows, height):
            shape = (min(height, rows - a) + 2, columns)
            ends = as_strided(x[a * self.m :], shape, (self.m * step, self._spread * step), writeable=False)
            means = np.diff(ends.copy().ravel() if columns == 1 else ends.copy(), axis=0)
            means[:-1] -= means[1:]
            d = means[:-1]
            self._sums[:columns] += squared(d) if columns == 1 else np.einsum("ij,ij->j", d, d)

    def add(self, x: Array, first: int) -> None:
        """Add its share of the terms that fit into `x`, which begins at sample `first`, for every offset."""
        last = first + len(x) - 1 - (self._offsets - 1) * self._spread
        rows = last // self.m - self._row - 1
        if rows > 0:
            taken = max(1, round(self._share * rows))
            self._add(x[self._row * self.m - first :], taken, self._offsets)
            self._row += rows
            self._terms += taken

    def finish(self, x: Array, first: int) -> tuple[Array, Array]:
        """Sums and terms of each offset, with the last term of those that have one more."""
        terms = np.full(self._offsets, float(self._terms))
        room = first + len(x) - 1 - (self._row + 2) * self.m
        more = min(self._offsets, room // self._spread + 1) if room >= 0 else 0
        if more:
            self._add(x[self._row * self.m - first :], 1, more)
            terms[:more] += 1
        return self._sums, terms
