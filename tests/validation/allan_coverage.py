"""How often the intervals of Allan deviations hold the truth, noise by noise; judged by the binomial distribution.

Allowed is the nominal coverage, widened where the docstring of `procedures.analysis.allan.confidence_intervals` says
that its formulas are not exact, and by the scatter of the sample: all checks together fail by chance once in a thousand
runs.
"""

from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.stats import binom

from procedures.analysis.allan.confidence_intervals import ONE_SIGMA, degrees_of_freedom, interval
from procedures.analysis.allan.deviation import Deviation, deviation
from procedures.analysis.allan.statistic import (
    ALLAN,
    HADAMARD,
    MODIFIED_ALLAN,
    OVERLAPPING_ALLAN,
    OVERLAPPING_HADAMARD,
    Statistic,
)

Array = NDArray[np.float64]

COUNT = 1 << 10
NOISES = {
    2: "white angle noise",
    1: "flicker angle noise",
    0: "white rate noise (angle random walk)",
    -1: "flicker rate noise (bias instability)",
    -2: "rate random walk",
}
MEMBERS = (ALLAN, OVERLAPPING_ALLAN, MODIFIED_ALLAN, HADAMARD, OVERLAPPING_HADAMARD)
CONFIDENCES = (ONE_SIGMA, 0.95)
FAMILY_LEVEL = 1e-3
_LENGTH = 4 * COUNT
_SIZES = (1, 4, 16, 64, COUNT // 8, COUNT // 4)


@dataclass(frozen=True)
class Coverage:
    """Coverage of one noise, member and cluster size."""

    alpha: int
    statistic: str
    m: int
    edf: float
    """By the formula for the true noise."""
    edf_ratio: float
    """Twice the squared mean of σ² over its variance, relative to `edf`."""
    identified: float
    covered: tuple[float, ...]
    """At each of `CONFIDENCES`."""
    allowed: tuple[tuple[float, float], ...]


def sizes(statistic: Statistic) -> list[int]:
    """Small ones to the longest, of which one term fits."""
    largest = statistic.largest(COUNT)
    return sorted({*(m for m in _SIZES if m <= largest), largest})


def spectrum(alpha: int) -> Array:
    """Amplitudes of the running sum of a rate of density ∝ f^α at the frequencies i/_LENGTH, sampled, (n,)."""
    f = np.arange(_LENGTH // 2 + 1) / _LENGTH
    found = np.zeros(len(f))
    found[1:] = (2.0 * np.sin(np.pi * f[1:])) ** (alpha / 2.0 - 1.0)
    return found


def record(alpha: int, rng: np.random.Generator) -> Array:
    """Rates, (COUNT,): a quarter of a periodic record."""
    white = fft.rfft(rng.normal(size=_LENGTH))
    return np.diff(fft.irfft(white * spectrum(alpha), _LENGTH)[: COUNT + 1])


def true_deviation(alpha: int, statistic: Statistic, m: int) -> float:
    """Root of the expectation of σ²: the spectrum of the running sum through the member's response (SP 1065, 3.3)."""
    f = np.arange(1, _LENGTH // 2 + 1) / _LENGTH
    over_m = 2.0 * np.sin(np.pi * f * m)
    response = over_m ** (2 * statistic.order)
    if statistic.modified:
        response *= (over_m / (2.0 * np.sin(np.pi * f)) / m) ** 2
    weights = np.where(f < 0.5, 2.0, 1.0) / _LENGTH
    power = float(np.sum(spectrum(alpha)[1:] ** 2 * weights * response))
    return float(np.sqrt(power / comb(2 * statistic.order - 2, statistic.order - 1))) / m


def coverages(alpha: int, records: int) -> list[Coverage]:
    """Every member and size on the same records of one noise."""
    rng = np.random.default_rng(500 + alpha)
    rates = [record(alpha, rng) for _ in range(records)]
    found: list[Coverage] = []
    for member in MEMBERS:
        results = [deviation(y, 1.0, member, sizes=sizes(member)) for y in rates]
        found += [_coverage(alpha, member, i, m, results) for i, m in enumerate(sizes(member))]
    return found


def _coverage(alpha: int, member: Statistic, i: int, m: int, results: list[Deviation]) -> Coverage:
    sigma, edf = (np.array([getattr(r, name)[i] for r in results]) for name in ("deviation", "edf"))
    truth, formula = true_deviation(alpha, member, m), degrees_of_freedom(member, alpha, m, COUNT)
    covered: list[float] = []
    for confidence in CONFIDENCES:
        lower, upper = interval(sigma, edf, confidence)
        covered.append(float(np.mean((lower <= truth) & (truth <= upper))))
    return Coverage(
        alpha=alpha,
        statistic=member.name,
        m=m,
        edf=formula,
        edf_ratio=float(2.0 * np.mean(sigma**2) ** 2 / np.var(sigma**2, ddof=1)) / formula,
        identified=float(np.mean([r.alpha[i] == alpha for r in results])),
        covered=tuple(covered),
        allowed=tuple(limits(alpha, member, m, c, len(results)) for c in CONFIDENCES),
    )


def declared(alpha: int, member: Statistic, m: int, confidence: float) -> tuple[float, float]:
    """Least and greatest true coverage, as `confidence_intervals` declares it."""
    edf = degrees_of_freedom(member, alpha, m, COUNT)
    one_sigma = confidence == ONE_SIGMA
    low, high = confidence, confidence
    if 1.1 < edf < 8.0:
        high += 0.06 if one_sigma else 0.025
    if alpha == 1 and member.overlapping and not member.modified:
        high += 0.05 if one_sigma else 0.015
    if alpha == -1:
        low -= 0.03 if one_sigma else 0.02
        high += 0.03 if one_sigma else 0.015
    if alpha < 0 and m == 1:
        low -= 0.04 if one_sigma else 0.02
        high += 0.03 if one_sigma else 0.01
    return low, min(high, 0.99)


def limits(alpha: int, member: Statistic, m: int, confidence: float, records: int) -> tuple[float, float]:
    """Between which coverages an honest interval lies: declared, and the binomial's tails beyond."""
    checks = len(NOISES) * len(CONFIDENCES) * sum(len(sizes(one)) for one in MEMBERS)
    tail = FAMILY_LEVEL / (2 * checks)
    low, high = declared(alpha, member, m, confidence)
    return float(binom.ppf(tail, records, low)) / records, float(binom.isf(tail, records, high)) / records


def failures(rows: list[Coverage]) -> list[str]:
    """A sentence for every coverage outside what is allowed."""
    return [
        f"{NOISES[row.alpha]}, {row.statistic}, m = {row.m}: {c:.1%} interval covers {p:.1%}, {low:.1%} to {high:.1%}"
        for row in rows
        for c, p, (low, high) in zip(CONFIDENCES, row.covered, row.allowed, strict=True)
        if not low <= p <= high
    ]
