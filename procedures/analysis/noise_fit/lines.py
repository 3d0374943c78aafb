"""Spectral lines: modes of a mean power spectrum that stand out of their neighbourhood. Knows no noise model."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import gammainccinv, gammaincinv

from procedures.core.arrays import Array

LEVEL = 1e-6
"""Probability that noise alone shows one line in a record."""
_HALF_WINDOW = 100
_FIRST = 2 * _HALF_WINDOW
"""Below this mode the spectrum bends too much within the window to tell a line."""
_GUARD = 2
"""Modes beside a line that are cut out with it: the taper's main lobe."""


@dataclass(frozen=True)
class SpectralLine:
    """One line that was cut out before the fit."""

    frequency_hz: float
    """Of its strongest mode."""
    amplitude: float
    """Of the sine of the same power [rate]."""


def find_lines(
    power: Array, dof: float, segment: int, rate_hz: float
) -> tuple[NDArray[np.bool_], tuple[SpectralLine, ...]]:
    """Which modes belong to lines, (m,), and the lines, of mean powers (m,) of modes 0…m−1 of `segment` samples.

    A mode stands out where its power over the local median passes what a χ² of `dof` degrees of freedom passes with
    probability `LEVEL` in the whole record. A sine of amplitude a puts a²L/4 into its modes, L samples a segment.
    """
    out = np.zeros(len(power), dtype=bool)
    if len(power) <= 2 * _FIRST:
        return out, ()
    level = median_filter(power, 2 * _HALF_WINDOW + 1, mode="nearest") / gammaincinv(0.5 * dof, 0.5)
    stands = power > level * gammainccinv(0.5 * dof, LEVEL / len(power))
    stands[:_FIRST] = False
    for shift in range(-_GUARD, _GUARD + 1):
        out |= np.roll(stands, shift)
    out[:_FIRST] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[0], out, [0]]).astype(np.int8))).reshape(-1, 2)
    lines: list[SpectralLine] = []
    for first, end in edges:
        excess = float(np.sum(power[first:end] - level[first:end] * 0.5 * dof))
        strongest = first + int(np.argmax(power[first:end]))
        lines.append(SpectralLine(float(strongest * rate_hz / segment), sqrt(max(0.0, 4.0 * excess / segment))))
    return out, tuple(lines)
