"""The graphical method as an algorithm: straight stretches of an Allan plot, and the coefficient on each line.

IEEE Std 952 Annex C, thesis 3.1: ``σ = √3·Q/τ``, ``N/√τ``, ``√(2 ln 2/π)·B``, ``K·√(τ/3)``, ``R·τ/√2``; so each line is
read at √3 s, 1 s, on its plateau over 0.664, at 3 s and at √2 s. A process whose slope appears nowhere on the plot is
absent (None), which is not zero. In a mixture every line also carries its neighbours' noise: N and above all B read
too high where the stretch is short. The fits of a model do not.
"""

from dataclasses import dataclass
from math import log, log10, pi, sqrt

import numpy as np

from procedures.analysis.allan.deviation import Deviation
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter

WINDOW = 0.25
"""Decades over which a local slope is taken."""
SHORTEST = 0.5
"""Least length of a stretch in decades; a bend between two slopes keeps an intermediate one for less."""
TOLERANCE = 0.1
"""Greatest difference of a local slope from its line's, unless its own standard deviation is greater."""
SHARPEST = 0.125
"""Greatest standard deviation of a local slope that still distinguishes one line from the next."""

LINES = {
    "quantization": (-1.0, sqrt(3.0)),
    "random_walk": (-0.5, 1.0),
    "bias_instability": (0.0, sqrt(2.0 * log(2.0) / pi)),
    "rate_random_walk": (0.5, 1.0 / sqrt(3.0)),
    "rate_ramp": (1.0, 1.0 / sqrt(2.0)),
}
"""Slope, and σ at τ = 1 s of a unit coefficient."""


@dataclass(frozen=True)
class Line:
    """One straight stretch of an Allan plot, and the coefficient that is read on it."""

    slope: float
    coefficient: float
    """Q [rate·s], N [rate·√s], B [rate], K [rate/√s] or R [rate/s]."""
    coefficient_sd: float
    """Standard deviation from the degrees of freedom of the best point; bias by other processes is not included."""
    from_s: float
    to_s: float


@dataclass(frozen=True)
class ReadOff:
    """Lines that were found on an Allan plot, one a process; None where a process is absent."""

    quantization: Line | None
    random_walk: Line | None
    bias_instability: Line | None
    rate_random_walk: Line | None
    rate_ramp: Line | None


def read_off(deviation: Deviation) -> ReadOff:
    """Return, for each noise process, the stretch of an Allan plot that has its slope, and the coefficient read there.
    `deviation`: of a rate, overlapping or not. Raises `BadParameter` for another statistic.
    """
    if deviation.statistic.order != 2 or deviation.statistic.modified:
        raise BadParameter("statistic", deviation.statistic.name, "allan or overlapping_allan")
    shown = deviation.deviation > 0.0  # a counter that turns evenly can repeat its counts exactly: no logarithm
    tau, sigma, edf = deviation.tau_s[shown], deviation.deviation[shown], deviation.edf[shown]
    first, last, slope, sd = _local_slopes(tau, sigma, edf)
    lines = {name: _line(tau, sigma, edf, first, last, slope, sd, *law) for name, law in LINES.items()}
    return ReadOff(**lines)


def _local_slopes(tau: Array, sigma: Array, edf: Array) -> tuple[list[int], list[int], Array, Array]:
    """Windows [first, last] of `WINDOW` decades, the slope of ln σ over ln τ in each, and its standard deviation.

    A point's ln σ has the standard deviation 1/√(2·edf); neighbours go together, so the ends' alone count.
    """
    x, y = np.log(tau), np.log(sigma)
    first: list[int] = []
    last: list[int] = []
    slopes: list[float] = []
    sds: list[float] = []
    for i in range(len(x)):
        j = int(np.searchsorted(x, x[i] + WINDOW * log(10.0) - 1e-9))
        if j == len(x):
            break
        part = slice(i, j + 1)
        centred = x[part] - np.mean(x[part])
        first.append(i)
        last.append(j)
        slopes.append(float(np.dot(centred, y[part]) / np.dot(centred, centred)))
        sds.append(sqrt(0.5 / float(edf[i]) + 0.5 / float(edf[j])) / float(x[j] - x[i]))
    return first, last, np.array(slopes), np.array(sds)


def _line(
    tau: Array,
    sigma: Array,
    edf: Array,
    first: list[int],
    last: list[int],
    slope: Array,
    sd: Array,
    wanted: float,
    unit: float,
) -> Line | None:
    """The longest stretch of windows that keep the wanted slope, and the weighted mean of its line."""
    keeps = (np.abs(slope - wanted) <= np.maximum(TOLERANCE, sd)) & (sd <= SHARPEST)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], keeps, [0]]).astype(int))).reshape(-1, 2)
    stretches = [(first[a], last[b - 1]) for a, b in edges]
    if not stretches:
        return None
    i, j = max(stretches, key=lambda s: log10(tau[s[1]] / tau[s[0]]))
    if log10(tau[j] / tau[i]) < SHORTEST:
        return None
    part = slice(i, j + 1)
    level = np.log(sigma[part] / (unit * tau[part] ** wanted))
    coefficient = float(np.exp(np.average(level, weights=edf[part])))
    return Line(wanted, coefficient, coefficient / sqrt(2.0 * float(edf[part].max())), float(tau[i]), float(tau[j]))
