"""Sums of squared differences of a long series for many cluster sizes at once, by block correlation.

``Σ_k (Σ_a c_a x_{k+am})² = Σ_{a,b} c_a c_b Σ_k x_{k+am} x_{k+bm}``: every sum on the right is one of lagged products,
and one Fourier transform a block gives these for all lags up to the block's length. Nothing is approximated but by
rounding, which grows with ``Σx² / ΣD²`` and is bounded by `worst_rounding`.
"""

from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from procedures.analysis.allan.statistic import Sizes
from procedures.core.arrays import Array

BLOCK = 1 << 15
"""Samples a block; two of them, transformed, still fit into the cache."""


class LaggedProducts:
    """``R(l) = Σ_{k<K} x_k x_{k+l}`` for l ≤ `BLOCK`, accumulated block after block.

    A straight line is taken off x: it changes no second difference, and keeps the products small.
    """

    def __init__(self, offset: float = 0.0, slope: float = 0.0) -> None:
        self._offset, self._step = offset, slope * BLOCK
        self._ramp = slope * np.arange(BLOCK)
        self._same = np.zeros(BLOCK + 1)
        self._next = np.zeros(BLOCK + 1, dtype=np.complex128)
        self._previous: NDArray[np.complex128] | None = None
        self._work = np.empty(BLOCK + 1, dtype=np.complex128)
        self._head = self._last = np.empty(0)
        self.starts = 0
        """K: starts whose products are in; the block that came last is not among them."""

    @property
    def is_empty(self) -> bool:
        return self._previous is None

    def add(self, block: Array) -> None:
        """One more block of x, (BLOCK,)."""
        self._last = block - self._ramp
        self._last -= self._offset
        self._offset += self._step
        spectrum = np.asarray(fft.rfft(self._last, 2 * BLOCK))
        previous = self._previous
        if previous is None:
            self._head = self._last
        else:
            np.conjugate(previous, out=self._work)
            self._work *= spectrum
            self._next += self._work
            self._same += np.square(previous.real)
            self._same += np.square(previous.imag)
            self.starts += BLOCK
        self._previous = spectrum

    def sums(self, sizes: Sizes, order: int) -> tuple[Array, float]:
        """``Σ_{k<K} (Δ_m^order x_k)²`` for each size m ≤ BLOCK/order, (k,), and ``Σ_{k<K} x_k²``."""
        both = self._next.copy()
        both[1::2] *= -1.0  # a shift by half the transform's length
        products = fft.irfft(both + self._same, 2 * BLOCK)[: BLOCK + 1]
        signs = [(-1) ** a * comb(order, a) for a in range(order + 1)]
        sums = np.zeros(len(sizes))
        for i, size in enumerate(sizes):
            m = int(size)
            for a in range(order + 1):
                for b in range(a, order + 1):
                    lag, skipped = (b - a) * m, a * m
                    total = products[lag]
                    total += np.dot(self._last[:skipped], self._last[lag : lag + skipped])
                    total -= np.dot(self._head[:skipped], self._head[lag : lag + skipped])
                    sums[i] += (1 if a == b else 2) * signs[a] * signs[b] * total
        return sums, float(products[0])


def worst_rounding(sums: Array, squares: float, order: int) -> float:
    """A bound of the relative rounding error of the sums: ``ε·4^p·Σx²/ΣD²`` (two to three times what is found)."""
    least = float(np.min(sums))
    return float(np.finfo(float).eps) * 4**order * squares / least if least > 0.0 else float("inf")
