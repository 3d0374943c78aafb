"""Upper limits of coefficients in a part of the spectrum that the noise model does not describe.

Powers of independent processes add: whatever else is in an octave, its power is at least that of any one process.
So ``v ≤ Σ squares/(χ²_ν(p/G)·mean column)`` in each of G octaves, p the probability that the limit fails.
"""

from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np
from scipy.special import chdtri

from procedures.analysis.noise_fit.bands import Agreement
from procedures.analysis.noise_fit.columns import RANDOM_WALK
from procedures.analysis.noise_fit.estimate import PROCESSES, Estimate
from procedures.analysis.noise_fit.joined import Joined
from procedures.analysis.noise_fit.selection import RAMP, VARIANCES
from procedures.core.arrays import Array

FAILS = 0.05
"""Probability that a limit fails."""
SHARE = 0.5
"""Share of the information on a coefficient whose exclusion leaves the coefficient undescribed."""
LEAST_POWER = 1e-100
"""Least power of a mode, in parts of the greatest: a record that repeats itself has modes without any."""
_RAMP_OCTAVES = 2
_SIGMAS = 2.0


@dataclass(frozen=True)
class Hidden:
    """Processes that the steps of the samples hide, whatever the spectrum shows."""

    least: dict[int, float]
    """Index in `PROCESSES` → what the steps may hide of its coefficient; the limit is no less."""


NOTHING = Hidden({})


def undescribed(agreement: Agreement, hidden: Hidden = NOTHING) -> tuple[int, ...]:
    """Return the indices in `PROCESSES` that the fit does not describe."""
    if not agreement.described:
        return tuple(range(len(PROCESSES)))
    found = set(hidden.least)
    holes, plain = agreement.holes, agreement.plain
    if np.any(holes):
        s = plain.spectrum
        power = s.squares / s.dof
        power = np.maximum(power, LEAST_POWER * float(power.max()))
        below = plain.frequency_hz <= float(plain.frequency_hz[plain.fitted][-1])
        for k in VARIANCES:
            told = s.dof * (_column(plain, k) / power) ** 2
            if np.sum(told[holes]) > SHARE * np.sum(told[below]):
                found.add(k)
        if holes[0]:
            found.add(len(PROCESSES) - 1)
    return tuple(sorted(found))


def limited(
    agreement: Agreement, estimates: tuple[Estimate, ...], numbers: tuple[int, ...], hidden: Hidden = NOTHING
) -> tuple[Estimate, ...]:
    """Return the estimates; those in `numbers` have no value, and the limit that the octaves' power sets."""
    return tuple(
        bounded(e, max(_limit(agreement.plain, i), hidden.least.get(i, 0.0))) if i in numbers else e
        for i, e in enumerate(estimates)
    )


def bounded(estimate: Estimate, limit: float) -> Estimate:
    """Return an estimate as not described, with an upper limit alone."""
    none = dict.fromkeys(("value", "standard_uncertainty", "lower", "upper"))
    return replace(estimate, **none, upper_limit=limit, described=False)


def _limit(plain: Joined, number: int) -> float:
    """Upper limit of one coefficient, from all octaves up to the highest that is fitted."""
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
    """Upper limit of the ramp: the slope in the lowest octaves plus twice its standard uncertainty from their power."""
    s = plain.spectrum
    low = plain.group < _RAMP_OCTAVES
    size = float(np.sum(s.gram[low, RAMP, RAMP]))
    slope = float(np.sum(s.products[low, RAMP])) / size
    return abs(slope) + _SIGMAS * sqrt(float(np.max(s.squares[low] / s.dof[low])) / size)


def _column(plain: Joined, k: int) -> Array:
    """Expected power (b,) of one process; that of white noise without the filter's edge."""
    return plain.white if k == RANDOM_WALK else plain.spectrum.columns[:, k]
