"""Coefficients of a part of the spectrum that the noise model does not describe: no value, but a limit that holds.

Powers of independent processes add: whatever else is in an octave, its power is at least what one process puts there.
So ``v ≤ Σ squares/(χ²_ν(p/G)·mean column)`` in each of G octaves, p the probability that the limit fails.
"""

from dataclasses import replace
from math import inf, sqrt

import numpy as np
from scipy.special import chdtri

from procedures.analysis.noise_fit.bands import Agreement
from procedures.analysis.noise_fit.columns import QUANTIZATION, RANDOM_WALK
from procedures.analysis.noise_fit.estimate import PROCESSES, Estimate
from procedures.analysis.noise_fit.joined import Joined
from procedures.analysis.noise_fit.selection import RAMP, VARIANCES
from procedures.core.arrays import Array

FAILS = 0.05
"""Probability that a limit fails."""
SHARE = 0.5
"""Of what a spectrum tells of a coefficient, from which on it is not described if that share was left out."""
_RAMP_OCTAVES = 2
_SIGMAS = 2.0


def undescribed(agreement: Agreement, *, coarse: bool) -> tuple[int, ...]:
    """Which of `PROCESSES`, by number, the fit does not describe; `coarse`: the noise is less than a count."""
    if not agreement.described:
        return tuple(range(len(PROCESSES)))
    found = {QUANTIZATION, RANDOM_WALK} if coarse else set[int]()
    holes, plain = agreement.holes, agreement.plain
    if np.any(holes):
        s = plain.spectrum
        power = np.maximum(s.squares / s.dof, np.finfo(float).tiny)
        below = plain.frequency_hz <= float(plain.frequency_hz[plain.fitted][-1])
        for k in VARIANCES:
            told = s.dof * (_column(plain, k) / power) ** 2
            if np.sum(told[holes]) > SHARE * np.sum(told[below]):
                found.add(k)
        if holes[0]:
            found.add(len(PROCESSES) - 1)
    return tuple(sorted(found))


def limited(agreement: Agreement, estimates: tuple[Estimate, ...], numbers: tuple[int, ...]) -> tuple[Estimate, ...]:
    """The estimates, those of some numbers without value and with the limit of the octaves' power."""
    return tuple(
        replace(
            e,
            value=None,
            standard_uncertainty=None,
            lower=None,
            upper=None,
            upper_limit=_limit(agreement.plain, i),
            described=False,
        )
        if i in numbers
        else e
        for i, e in enumerate(estimates)
    )


def _limit(plain: Joined, number: int) -> float:
    """Of one coefficient, from all octaves up to the highest that is fitted."""
    if number not in VARIANCES:
        return _ramp_limit(plain)
    s, group = plain.spectrum, plain.group
    below = plain.frequency_hz <= float(plain.frequency_hz[plain.fitted][-1])
    octaves = np.unique(group[below])
    column, least = _column(plain, number), inf
    for octave in octaves:
        own = below & (group == octave)
        dof = float(np.sum(s.dof[own]))
        mean = float(np.dot(s.dof[own], column[own])) / dof
        if mean > 0.0:
            least = min(least, float(np.sum(s.squares[own])) / float(chdtri(dof, 1.0 - FAILS / len(octaves))) / mean)
    return sqrt(least)


def _ramp_limit(plain: Joined) -> float:
    """The slope of the lowest octaves, and twice what their power leaves unknown of it."""
    s = plain.spectrum
    low = plain.group < _RAMP_OCTAVES
    size = float(np.sum(s.gram[low, RAMP, RAMP]))
    slope = float(np.sum(s.products[low, RAMP])) / size
    return abs(slope) + _SIGMAS * sqrt(float(np.max(s.squares[low] / s.dof[low])) / size)


def _column(plain: Joined, k: int) -> Array:
    """Expected power (b,) of one process, the white one without a filter's edge."""
    return plain.white if k == RANDOM_WALK else plain.spectrum.columns[:, k]
