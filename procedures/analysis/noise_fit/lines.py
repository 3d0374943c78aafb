"""Detection of spectral lines: modes of a mean power spectrum above their neighbourhood, without any noise model."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import fdtri, gammaincinv

from procedures.core.arrays import Array

LEVEL = 1e-6
"""Probability that noise alone shows one line in a record."""
_HALF_WINDOW = 100
_FEWEST_MODES = 32
_FIRST = 8
"""First mode of a segment whose main lobe of the taper does not overlap the subtracted mean."""
_GUARD = 2
"""Modes on each side of a line that are cut out with it: the main lobe of the taper."""
_EFFICIENCY = 0.6
"""Degrees of freedom of a median over those of a mean."""


@dataclass(frozen=True)
class SpectralLine:
    """One spectral line that was cut out before the fit: frequency and amplitude."""

    frequency_hz: float
    """Frequency of the strongest mode of the line."""
    amplitude: float
    """Amplitude of a sine of the same power [rate]."""


def levels_around(power: Array, dof: float, first: int = 0) -> tuple[Array, Array]:
    """Level of the noise about each mode, as of a χ²_dof of unit scale, and from how many modes, (m,) each.

    The median of as many modes as lie within ±100, at low modes within a factor of two: on a slope its middle value.
    Below the mode `first` it is not computed.
    """
    count = len(power)
    half = np.minimum(np.arange(count) // 2, _HALF_WINDOW)
    level = median_filter(power, min(2 * _HALF_WINDOW + 1, 2 * count - 1), mode="reflect")
    number = np.full(count, 2.0 * _HALF_WINDOW + 1.0)
    for k in range(first, min(2 * _HALF_WINDOW, count)):  # evenly in the logarithm, so that a power law has no bias
        ends = max(1, k - half[k]), min(count, 2 * k + 1, k + _HALF_WINDOW + 1)
        if ends[1] > ends[0]:
            level[k] = np.median(power[ends[0] : ends[1]])
            number[k] = ends[1] - ends[0]
    return level / gammaincinv(0.5 * dof, 0.5) / 2.0, number


def standing_out(dof: float, count: Array, level: float) -> Array:
    """Threshold (m,) that a mode's power over the level about it exceeds with this probability, in scales of χ²_dof.

    The level is itself the mean of `count` modes: an F ratio of dof and dof·count degrees of freedom.
    """
    some, where = np.unique(count, return_inverse=True)  # the quantile is slow, and most modes share one count
    return (dof * np.asarray(fdtri(dof, np.maximum(1.0, dof * some), 1.0 - level)))[where]


def find_lines(
    power: Array, dof: float, segment: int, rate_hz: float
) -> tuple[NDArray[np.bool_], tuple[SpectralLine, ...]]:
    """The mask of line modes, (m,), and the lines, in mean powers (m,) of modes 0…m−1 of `segment` samples.

    A mode belongs to a line where its power over the level about it exceeds the value that noise exceeds with
    probability `LEVEL` in the whole record. A sine of amplitude a puts a²L/4 into its modes, L samples a segment.
    """
    out = np.zeros(len(power), dtype=bool)
    if len(power) <= _FEWEST_MODES:
        return out, ()
    level, count = levels_around(power, dof)
    stands = power > level * standing_out(dof, _EFFICIENCY * count, LEVEL / len(power))
    stands[:_FIRST] = False
    for shift in range(-_GUARD, _GUARD + 1):
        out |= np.roll(stands, shift)
    out[: _FIRST - _GUARD] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[0], out, [0]]).astype(np.int8))).reshape(-1, 2)
    lines: list[SpectralLine] = []
    for first, end in edges:
        excess = float(np.sum(power[first:end] - level[first:end] * dof))
        strongest = first + int(np.argmax(power[first:end]))
        lines.append(SpectralLine(float(strongest * rate_hz / segment), sqrt(max(0.0, 4.0 * excess / segment))))
    return out, tuple(lines)
