"""Sums of squared differences for every start of a long series and many cluster sizes at once, by block correlation.

With the running sum x of the samples y, ``x_k = Σ_{i<k} y_i``, every sum of squared differences of x is one of its
structure function ``V(q) = Σ_k (x_{k+q} − x_k)²``, and V of the lagged products ``R(l) = Σ_k y_k y_{k+l}``, for
``V(q+1) − 2V(q) + V(q−1) = 2R(q)``. One Fourier transform a window gives R at all lags. Nothing is approximated but
by rounding, which grows with ``Σy² / ΣD²`` and is bounded by `worst_rounding`.
"""

from collections.abc import Callable
from math import comb

import numpy as np
from numpy.lib.stride_tricks import as_strided
from scipy import fft

from procedures.analysis.allan.statistic import Sizes, Statistic
from procedures.core.arrays import Array

SPAN = 16
"""Ratio of a transform's length to the longest lag, made a power of two; large, so that little is spent on padding."""
TOGETHER = 4
"""Fewest windows that are transformed at once: the rows share the processor's wide registers."""


class LaggedProducts:
    """``R(l) = Σ_k y_k y_{k+l}`` for l < `reach`, accumulated from pieces of any length; no sample is left out.

    Windows overlap by `reach` samples, so that every pair lies in one of them; pairs inside the overlaps, which lie in
    two, are subtracted again. Call `add` for each piece, then `finish` once.
    """

    def __init__(self, reach: int, kernel: Array) -> None:
        """Set up; `kernel`: κ(l), (≤ reach,), weights of the sums in `energies`; see `averages.remainder_kernel`."""
        self._reach, self._length = reach, 1 << (SPAN * reach).bit_length() - 1
        self._window = self._length - reach
        self._rest = np.empty(0)
        self._power, self._seams = np.zeros(self._length + 2), np.zeros(2 * reach + 2)
        self._response, self._seam_response = _response(kernel, self._length), _response(kernel, 2 * reach)
        self._shape = np.zeros(self._length + 2)
        self.ends: list[int] = [0]
        self.energies: list[float] = [0.0]
        """``Σ_l κ(l) R(l)``, l of both signs, up to each of `ends` (one a window)."""

    def add(self, y: Array) -> None:
        """Add the next samples, (n,), without gaps."""
        self._rest = np.concatenate([self._rest, y])
        self._take_whole(TOGETHER)

    def _take_whole(self, least: int) -> None:
        step = self._window - self._reach
        rows = (len(self._rest) - self._window) // step + 1
        if rows >= least:
            stride = self._rest.strides[0]
            shape, strides = (rows, self._window), (step * stride, stride)
            self._take(as_strided(self._rest, shape, strides, writeable=False), step)
            self._rest = self._rest[rows * step :]

    def finish(self) -> Array:
        """Return the lagged products R, (reach,). Call once, after the last piece."""
        self._take_whole(1)
        if len(self._rest):
            self._take(self._rest[None, :], len(self._rest))
        products = _inverse(_paired(self._power), self._length)[: self._reach]
        return products - _inverse(_paired(self._seams), 2 * self._reach)[: self._reach]

    def spectrum(self) -> Array:
        """Return the mean over the windows of each window's share of `energies` by frequency, (length/2 + 1,); the sum
        is near 1.
        """
        return _paired(self._shape * self._response) / (len(self.ends) - 1)

    def _take(self, windows: Array, step: int) -> None:
        seams = windows[:, : self._reach]
        if self.ends[-1] == 0:
            seams = seams * np.where(np.arange(len(windows)) > 0, 1.0, 0.0)[:, None]  # none before the first
        power, twice = _powers(windows, self._length), _powers(seams, 2 * self._reach)
        whole = power @ self._response
        even = np.divide(1.0, whole, out=np.zeros(len(whole)), where=whole > 0.0)
        added = np.stack([np.ones(len(whole)), even]) @ power
        self._power += added[0]
        self._shape += added[1]
        self._seams += twice.sum(axis=0)
        for energy in whole - twice @ self._seam_response:
            self.energies.append(self.energies[-1] + float(energy))
            self.ends.append(self.ends[-1] + step)


def _powers(rows: Array, length: int) -> Array:
    """Squares of the real and imaginary parts of each row's transform, padded to `length`, (rows, length + 2)."""
    parts = np.asarray(fft.rfft(rows, length)).view(np.float64)
    return np.multiply(parts, parts, out=parts)


def _inverse(squares: Array, length: int) -> Array:
    return np.asarray(fft.irfft(squares, length), dtype=np.float64)


def _paired(squares: Array) -> Array:
    """Squared magnitudes |Y|² from squares of parts, (n/2,) from (n,)."""
    return squares[0::2] + squares[1::2]


def _response(kernel: Array, length: int) -> Array:
    """Weights of the squares of parts whose sum is ``Σ_l κ(l) R(l)``, (length + 2,)."""
    both = np.zeros(length)
    both[: len(kernel)] = kernel
    both[length - len(kernel) + 1 :] += kernel[:0:-1]
    weights = np.asarray(fft.rfft(both)).real * 2.0 / length
    weights[[0, -1]] /= 2.0
    return np.repeat(weights, 2)


def padded_sums(products: Array, statistic: Statistic, sizes: Sizes) -> Array:
    """``Σ_k D_k²`` over all k of the series continued by zeros at both ends, (k,), for sizes whose terms fit the reach.

    ``−½ Σ_j b_j V(jm)``, b the autocorrelation of the d-th difference's coefficients; of a modified statistic with
    one difference more and the double sum of V in its place.
    """
    structure = _twice_summed(2.0 * products)
    d = statistic.order
    if statistic.modified:
        structure, d = _twice_summed(structure), d + 1
    sign = 1.0 if statistic.modified else -1.0
    sums = np.zeros(len(sizes))
    for j in range(1, d + 1):
        sums += sign * (-1) ** j * comb(2 * d, d + j) * structure[j * sizes]
    return sums


def _twice_summed(u: Array) -> Array:
    """w with ``w(q+1) − 2w(q) + w(q−1) = u(q)`` and w(0) = 0, both symmetric in q: (n + 1,) from (n,)."""
    slopes = np.cumsum(u) - u[0] / 2.0  # a constant in w changes no difference of it
    return np.concatenate([[0.0], np.cumsum(slopes)])


def edge_sums(
    head: Array, tail: Array, sizes: Sizes, span: Callable[[int], int], squares: Callable[[Array, int, int], float]
) -> Array:
    """The part of `padded_sums` whose terms touch the zeros, (k,).

    `head` and `tail`: the series' first and last samples, at least as many as a term spans; ``span(m)`` samples a term
    spans; ``squares(x, m, stop)`` the sum of the first `stop` squared terms of a running sum.
    """
    left = np.concatenate([np.zeros(len(head) + 1), np.cumsum(head)])
    end = np.cumsum(tail)
    right = np.concatenate([[0.0], end, np.full(len(tail), end[-1])])
    sums = np.zeros(len(sizes))
    for i, size in enumerate(sizes):
        m, terms = int(size), span(int(size)) - 1
        sums[i] = squares(left[len(head) - terms : len(head) + terms + 1], m, terms)
        sums[i] += squares(right[len(tail) - terms : len(tail) + terms + 1], m, terms)
    return sums


def worst_rounding(sums: Array, spans: Sizes, squares: float) -> float:
    """Return a bound of the relative rounding error of the sums, R known to 16ε: ``16ε·Σy²·span^1.5/ΣD²``."""
    bounds = 16.0 * float(np.finfo(float).eps) * squares * spans**1.5
    return float(np.max(bounds / sums)) if np.all(sums > 0.0) else float("inf")
