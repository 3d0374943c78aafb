"""The resolution of a clock: the decimal step that all its stamps are multiples of."""

import numpy as np

from procedures.core.arrays import Array

COARSEST, FINEST = 6, -12
"""Powers of ten that are tried, in the unit of the stamps."""
ENOUGH = 64
"""Stamps that make a coincidence unlikely: all of them multiples of ten by chance is one in 10^64."""
SAMPLED, PARTS = 512, 8
"""Stamps in a row that are looked at, and of such rows; every n-th stamp alone could be rounder than the others."""


def decimal_step(stamps: Array, error: float) -> float:
    """The largest power of ten that all stamps are multiples of, or their rounding error where that is larger.

    `stamps` are relative to the first, of shape (n,); `error` is by how much each may be off its decimal value.
    """
    sample = stamps
    if len(stamps) > SAMPLED * PARTS:
        begins = np.linspace(0, len(stamps) - SAMPLED, PARTS).astype(int)
        sample = np.concatenate([stamps[b : b + SAMPLED] for b in begins])
    for exponent in range(COARSEST, FINEST - 1, -1):
        step = 10.0**exponent
        allowed = 4.0 * error / step + 1e-7
        if allowed > 0.05:
            break
        parts = sample / step
        if np.all(np.abs(parts - np.rint(parts)) <= allowed):
            return step
    return error


class Resolution:
    """Running estimate of a clock's resolution, in the stamps' unit: the finest, and a coarser one that comes later."""

    def __init__(self) -> None:
        self.finest = np.inf
        self.later = 0.0
        """Coarsest resolution of a part that follows finer ones: with fixed digits, a stamp that grows loses some."""
        self._before = np.inf

    def add(self, stamps: Array, error: float) -> None:
        """Take in more stamps, relative to the first, each off its decimal value by `error` at the most."""
        self.finest = min(self.finest, decimal_step(stamps, error))
        if len(stamps) < ENOUGH:
            return
        for part in np.array_split(stamps, min(PARTS, len(stamps) // ENOUGH)):
            if np.ptp(part) > 0.0:
                step = decimal_step(part, error)
                self.later = max(self.later, step) if step > self._before else self.later
                self._before = min(self._before, step)
