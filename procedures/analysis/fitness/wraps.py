"""Jumps of 2^n: signed counts that were read as unsigned, counters that wrap, temperatures of too few bits.

Where a channel lies in a range of 2^n and every large difference of two samples is nearly 2^n, the jumps come from the
range and not from the quantity; taken modulo 2^n the channel is quiet.
"""

from dataclasses import dataclass

import numpy as np

from procedures.analysis.fitness.pieces import Piece, largest

LEAST_BITS, MOST_BITS = 7, 33
NEAR = 1.0 / 8.0
"""A jump is nearly 2^n within this part of it; other differences must be smaller than that."""
OTHERS = 0.02
"""Share of the large differences that may have another size: outliers."""
BETWEEN, SAMPLED = 0.05, 16
"""Share of every sixteenth difference between 1/8 and 7/8 of the largest from which on the jumps are noise."""
TEMPERATURE_K = (128.0, 256.0)
"""Ranges of temperatures in whole or fractional kelvins of eight and nine bits."""


@dataclass(frozen=True)
class Wrap:
    """A range that a channel jumps through. `size` raw; `unsigned`: the range begins with 0."""

    size: float
    count: int
    first_index: int
    unsigned: bool


class Wraps:
    """Running counts of the jumps of every channel, by size."""

    def __init__(self, gains_k: list[float | None]) -> None:
        """Start with no samples; `gains_k`: kelvins per raw unit of each temperature channel, None for others."""
        number = len(gains_k)
        self._gains = gains_k
        self._near = np.zeros((number, MOST_BITS + 1), np.int64)
        self._large = np.zeros(number, np.int64)
        self._first = [-1] * number
        self._kelvins = np.zeros((number, len(TEMPERATURE_K)), np.int64)

    def add(self, piece: Piece) -> None:
        """Add the next piece of samples."""
        d = piece.d
        if not d.shape[1]:
            return
        peak = largest(d)
        for c in np.flatnonzero(peak > 0.0).tolist():
            gain = self._gains[c]
            if gain is None and peak[c] < 2.0**LEAST_BITS * (1.0 - NEAR):
                continue
            some = np.abs(d[c, ::SAMPLED])
            if np.count_nonzero((some > NEAR * peak[c]) & (some < (1.0 - NEAR) * peak[c])) <= BETWEEN * len(some):
                row = np.abs(d[c].astype(np.float64))
                self._count(c, row, piece.start + piece.x.shape[1] - len(row), gain)

    def found(self, c: int, low: float, high: float) -> Wrap | None:
        """Return the wrap of a channel whose values lie between `low` and `high`, or None."""
        gain = self._gains[c]
        for size, count in zip(TEMPERATURE_K, self._kelvins[c].tolist(), strict=True):
            if gain is not None and count:
                return Wrap(size / abs(gain), count, self._first[c], low >= 0.0)
        bits = int(np.argmax(self._near[c]))
        count, size = int(self._near[c, bits]), 2.0**bits
        if not count or self._large[c] - count > OTHERS * self._large[c]:
            return None
        begin = 0.0 if low >= 0.0 else -size / 2.0
        if not (begin <= low and high < begin + size and (1.0 - NEAR) * size <= high - low):
            return None
        return Wrap(size, count, self._first[c], low >= 0.0)

    def _count(self, c: int, row: np.ndarray[tuple[int], np.dtype[np.float64]], start: int, gain: float | None) -> None:
        if gain is not None:
            kelvins = row * abs(gain)
            for i, size in enumerate(TEMPERATURE_K):
                near = np.abs(kelvins - size) < NEAR * size / 2.0
                self._kelvins[c, i] += np.count_nonzero(near)
                if near.any() and self._first[c] < 0:
                    self._first[c] = start + int(np.argmax(near))
        large = np.flatnonzero(row > NEAR * row.max())
        sizes = row[large]
        bits = np.rint(np.log2(np.maximum(sizes, 1.0))).astype(np.int64)
        near = (np.abs(sizes / 2.0**bits - 1.0) < NEAR) & (bits >= LEAST_BITS) & (bits <= MOST_BITS)
        self._near[c] += np.bincount(bits[near], minlength=MOST_BITS + 1)[: MOST_BITS + 1]
        self._large[c] += len(large)
        if near.any() and self._first[c] < 0:
            self._first[c] = start + int(large[int(np.argmax(near))])
