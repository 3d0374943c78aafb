"""Confidence intervals of Allan deviations: equivalent degrees of freedom, and the chi-square interval made from them.

C. A. Greenhall and W. J. Riley, "Uncertainty of Stability Variances Based on Finite Differences", PTTI 2003, the
combined algorithm; NIST SP 1065, 5.4.1 (edf) and eq. 45 (interval).

The coverage of the intervals was measured (`tests.validation.allan`, 2000 records of 1024 samples, sampled power laws,
the noise identified and not given): it is nominal for white angle and white rate noise, and elsewhere except for

* the longest sizes, with 1 to 8 degrees of freedom, where a sum of squares is no χ²: up to 76 % instead of 68.3 %,
  98 % instead of 95 %;
* flicker angle noise of the overlapping members, whose edf are 10 to 20 % too low: up to 78 % and 97 %;
* flicker rate noise, which looks like a random walk in 61 of 100 records of 64 points and fewer: overlapping 72 % (with
  few degrees of freedom 77 %) and 97 %, non-overlapping Hadamard 65 % and 93 %;
* m = 1 of flicker and random walk of the rate, where a sampled noise is not the formula's: 64 to 71 %, 93 to 96 %.

The least coverage anywhere is 64 % and 92.7 %.
"""

from functools import lru_cache
from math import ceil, comb, inf, log

import numpy as np
from scipy.special import erf, gammaincinv

from procedures.analysis.allan.statistic import Statistic
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter

ONE_SIGMA = float(erf(np.sqrt(0.5)))
"""Confidence of one sigma, 68.27 %."""
_MOST = 100
"""J_max: terms summed before a closed form takes over."""

_MODIFIED = {  # (α, d): a0, a1 of Table 1
    (2, 2): (7 / 9, 1 / 2),
    (1, 2): (0.997, 0.616),
    (0, 2): (1.033, 0.607),
    (-1, 2): (1.048, 0.534),
    (-2, 2): (1.302, 0.535),
    (2, 3): (22 / 25, 2 / 3),
    (1, 3): (1.141, 0.843),
    (0, 3): (1.184, 0.848),
    (-1, 3): (1.180, 0.816),
    (-2, 3): (1.175, 0.777),
    (-3, 3): (1.194, 0.703),
    (-4, 3): (1.489, 0.702),
}
_UNMODIFIED = {  # (α, d): a0, a1 of Table 2
    (1, 2): (790.0, 410.0),
    (0, 2): (2 / 3, 1 / 3),
    (-1, 2): (0.852, 0.375),
    (-2, 2): (1.079, 0.368),
    (1, 3): (9950.0, 6520.0),
    (0, 3): (7 / 9, 1 / 2),
    (-1, 3): (0.997, 0.617),
    (-2, 3): (1.033, 0.607),
    (-3, 3): (1.053, 0.553),
    (-4, 3): (1.302, 0.535),
}
_FLICKER = {2: (15.23, 12.0), 3: (47.8, 40.0)}  # d: b0, b1 of Table 3


@lru_cache(maxsize=1 << 14)
def degrees_of_freedom(statistic: Statistic, alpha: int, m: int, count: int, *, averaged: bool = False) -> float:
    """Degrees of freedom, edf, of a member at cluster size m of `count` samples, for exponent α (see `identification`).

    d is the statistic's order, S the starts a cluster (m overlapping, else 1), L the samples of x in one term, M the
    terms, ``r = M/S`` and ``J = min(M, (d + 1)S)``. Every case is ``1/edf = Σ_j w_j s_z(j/S)² / (s_z(0)² M)`` or the
    fit of it for large J. The published algorithm (and Stable32) takes x as ``averaged`` over the sample period; an
    integrated rate is not: a white rate at m = 1 has edf = 2N/3, not 0.78 N. It matters up to m = 33. Raises
    `BadParameter` where ``α + 2d ≤ 1`` (the variance does not converge).
    """
    d = statistic.order
    if not (-2 * d < alpha - 1 and alpha <= 2):
        raise BadParameter("alpha", alpha, f"{2 - 2 * d} to 2 for {statistic.name}")
    s = m if statistic.overlapping else 1
    length = m * d + (m if statistic.modified else 1)
    terms = 1 + s * (count + 1 - length) // m
    r, j = terms / s, min(terms, (d + 1) * s)
    if statistic.modified and (m > 1 or averaged):
        return 1.0 / _inverse_modified(alpha, d, r, j, terms, s)
    if alpha == 2:
        return 1.0 / _inverse_white_angle(d, r, terms)
    if alpha == 1:
        return 1.0 / _inverse_flicker_angle(d, m, r, j, terms, s)
    if j <= _MOST:
        return 1.0 / _sum(j, terms, s, m if averaged and m * (d + 1) <= _MOST else inf, alpha, d)
    if r >= d + 1:
        a0, a1 = _UNMODIFIED[alpha, d]
        return r / (a0 - a1 / r)
    return 1.0 / _sum(_MOST, _MOST, _MOST / r, inf, alpha, d)


def _inverse_modified(alpha: int, d: int, r: float, j: int, terms: int, s: int) -> float:
    if j <= _MOST:
        return _sum(j, terms, s, 1.0, alpha, d)
    if r >= d + 1:
        a0, a1 = _MODIFIED[alpha, d]
        return (a0 - a1 / r) / r
    return _sum(_MOST, _MOST, _MOST / r, 1.0, alpha, d)


def _inverse_flicker_angle(d: int, m: int, r: float, j: int, terms: int, s: int) -> float:
    if j <= _MOST:
        return _sum(j, terms, s, float(m), 1, d)
    b0, b1 = _FLICKER[d]
    level = (b0 + b1 * log(m)) ** 2
    if r >= d + 1:
        a0, a1 = _UNMODIFIED[1, d]
        return (a0 - a1 / r) / (r * level)
    scale = _MOST / r
    return _sum(_MOST, _MOST, scale, scale, 1, d) * _z(np.zeros(1), scale, 1, d)[0] ** 2 / level


def _inverse_white_angle(d: int, r: float, terms: int) -> float:
    if ceil(r) <= d:
        others = sum((1 - k / r) * comb(2 * d, d - k) ** 2 for k in range(1, ceil(r)))
        return (1 + 2 * others / comb(2 * d, d) ** 2) / terms
    return (comb(4 * d, 2 * d) / comb(2 * d, d) ** 2 - d / (2 * r)) / terms


def _sum(j: int, terms: float, s: float, f: float, alpha: int, d: int) -> float:
    """``(s_z(0)² + 2Σ_{i<J} (1 − i/M) s_z(i/S)² + (1 − J/M) s_z(J/S)²) / (s_z(0)² M)`` (eq. 10)."""
    i = np.arange(j + 1)
    weights = 2.0 * (1.0 - i / terms)
    weights[0], weights[-1] = 1.0, 1.0 - j / terms
    z2 = _z(i / s, f, alpha, d) ** 2
    return float(np.sum(weights * z2) / (z2[0] * terms))


def _z(t: Array, f: float, alpha: int, d: int) -> Array:
    """Autocovariance of the d-th differences (eq. 9): ``(−1)^d δ₁^{2d} s_x``."""
    return np.sum([(-1) ** k * comb(2 * d, d - k) * _x(t + k, f, alpha) for k in range(-d, d + 1)], axis=0)


def _x(t: Array, f: float, alpha: int) -> Array:
    """Autocovariance of the filtered angle (eq. 8): ``F²(2s_w(t) − s_w(t − 1/F) − s_w(t + 1/F))``."""
    if f == inf:
        return _w(t, alpha + 2)
    return f**2 * (2 * _w(t, alpha) - _w(t - 1 / f, alpha) - _w(t + 1 / f, alpha))


def _w(t: Array, alpha: int) -> Array:
    """Generalised autocovariance of the integrated angle (eq. 7), up to a factor."""
    size, power = np.abs(t), 3 - alpha
    if alpha % 2 == 0:
        return (-1.0 if alpha == 2 else 1.0) * size**power
    return size**power * np.log(np.where(size > 0.0, size, 1.0))


def interval(deviation: Array, edf: Array, confidence: float) -> tuple[Array, Array]:
    """Return the ends of the interval, (k,) each: ``σ·√(edf/χ²)`` at the two quantiles ``(1 ± confidence)/2`` of χ²
    with edf degrees of freedom (eq. 45). Raises `BadParameter` for a confidence outside 0 … 1.
    """
    if not 0.0 < confidence < 1.0:
        raise BadParameter("confidence", confidence, "0 < confidence < 1")
    low, high = (2.0 * gammaincinv(edf / 2.0, (1.0 + side * confidence) / 2.0) for side in (1.0, -1.0))
    return deviation * np.sqrt(edf / low), deviation * np.sqrt(edf / high)
