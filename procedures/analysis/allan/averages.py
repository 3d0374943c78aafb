"""Block means of the running sum, and the remainders within the blocks: sums of squares for clusters of many blocks.

With a_b the mean and e the remainder of x in blocks of s samples, and clusters of ``m = M·s`` samples,
``Σ_k (Δ_m^d x_k)² = s·Σ_b (Δ_M^d a_b)² + Σ_k (Δ_m^d e_k)²``. The first sum has s times fewer terms and takes in every
start. In the second, products of remainders m and more samples apart have no expectation, so that it is
``C(2d, d)·Σ e²``. Omitting them costs a variance only: where white angle noise alone dominates (the worst case),
``√Σ_{j≥1} C(2d, d+j)² / (C(2d, d)·√terms)`` of σ for Allan and Hadamard, 0.023 % and 0.028 % of 8.64 million terms.
A drifting rate (flicker, random walk) leaves out ``≈ (s/m)²/4``: 2·10⁻⁴ of σ² at the smallest such cluster. Only
a periodic signal faster than the blocks keeps its products; `lines` detects it. The strength of the remainders is known
for every window of the correlation (61 440 samples, for Allan), which matters where the noise comes in bursts.
"""

from math import ceil, log2

import numpy as np
from numpy.typing import NDArray

from procedures.core.arrays import Array

LEAST = 32
"""Fewest samples of a block."""
MOST_BLOCKS = 1 << 21
"""Most blocks that are held in memory."""
CHORD = 32
"""Blocks over which the mean rate is subtracted from the remainder."""
NEIGHBOURS = 64
"""Number of neighbouring frequencies whose median a line exceeds."""
STANDS_OUT = 4.0
"""Ratio of a line to that median, at least."""


def block_of(count: int) -> int:
    """Return the number of samples per block, s: a power of two, for a series of `count` samples."""
    return LEAST << max(0, ceil(log2(count / (LEAST * MOST_BLOCKS))))


def remainder_kernel(s: int) -> Array:
    """κ(l), (CHORD·s,), with ``Σ_l κ(l) R(l) = Σ e²``, R the samples' lagged products, l of both signs.

    e is x in a block without its mean and, since it is no noise, without the line of the mean rate over `CHORD`
    blocks around it; averaged over the starts of the blocks.
    """
    span = CHORD * s
    begin = (span - s) // 2
    i, j = np.arange(s), np.arange(s)[:, None]
    filters = np.repeat(-(j - (s - 1) / 2.0) / span, span, axis=1)
    filters[:, begin : begin + s] += (i < j) - (s - 1.0 - i) / s
    power = np.zeros(span + 1)
    for rows in np.array_split(filters, max(1, s // 32)):
        spectrum = np.fft.rfft(rows, 2 * span)
        power += np.sum(spectrum.real**2 + spectrum.imag**2, axis=0)
    return np.fft.irfft(power, 2 * span)[:span] / s


def lines(spectrum: Array) -> float:
    """Return the share of spectral lines in the remainders' spectrum (n,): power far above the median of its
    neighbourhood.
    """
    bands = spectrum[: len(spectrum) // NEIGHBOURS * NEIGHBOURS].reshape(-1, NEIGHBOURS)
    above = bands - STANDS_OUT * np.median(bands, axis=1)[:, None]
    # The first band, where the remainders begin, is steep and has no lines of importance.
    return float(np.sum(above[1:], where=above[1:] > 0.0) / np.sum(bands))


class BlockMeans:
    """The running sum at the beginning of every block, and its mean over the block, from samples."""

    def __init__(self, count: int) -> None:
        self.size = s = block_of(count)
        self.begins = np.zeros(count // s + 1)
        """x at 0, s, 2s…"""
        self._means = np.zeros(count // s, np.float32)
        self._weights = (s - 1.0 - np.arange(s)) / s
        self._ones = np.ones(s)
        self._carry = np.empty(0)
        self._done = 0

    def add(self, y: Array) -> None:
        """Add the next samples, (n,)."""
        if len(self._carry):
            y = np.concatenate([self._carry, y])
        whole = len(y) // self.size
        rows, done = y[: whole * self.size].reshape(-1, self.size), self._done
        ends = rows @ self._ones
        if whole:
            ends[0] += self.begins[done]
        self.begins[done + 1 : done + 1 + whole] = np.cumsum(ends, out=ends)
        self._means[done : done + whole] = rows @ self._weights
        self._carry = y[whole * self.size :].copy()
        self._done += whole

    def means(self) -> Array:
        """Return the means of the running sum over each whole block so far, (count // size,)."""
        return self.begins[:-1] + self._means


def weighted_mean(ends: Array, totals: Array, starts: NDArray[np.int64], length: int) -> Array:
    """Return the mean per sample over [start, start + length), (k,), of a quantity with the running totals `totals` at
    `ends`.
    """
    upper, lower = (np.interp(at, ends, totals) for at in (starts + length, starts))
    return (upper - lower) / length
