"""Noise coefficients by non-negative weighted least squares of an Allan variance, with a covariance.

``σ²(τ) = 3Q²/τ² + N²/τ + (2 ln 2/π)B² + K²τ/3 + R²τ²/2`` (IEEE Std 952 Annex C; thesis 3.1) is linear in the squares
v of the coefficients: ``v = (AᵀWA)⁻¹AᵀW σ²``, W diagonal with edf/(2σ⁴), σ the model's, iterated, v ≥ 0. Points of one
curve share their samples, so the covariance is the sandwich ``(AᵀWA)⁻¹AᵀW C W A(AᵀWA)⁻¹``, C the covariance of the
points: their correlation from the model's spectrum S, ``∫S²|H₁|²|H₂|² df`` normalised, with ``|H_m|² =
2 sin⁴(πfmΔ)/(m² sin²(πfΔ))``; their variances 2σ⁴/edf. The flicker is taken without limits of its band.
"""

from math import erfc, pi, sqrt

import numpy as np
from scipy.optimize import nnls
from scipy.special import ndtri

from procedures.analysis.allan.deviation import Deviation
from procedures.analysis.least_squares.inverse import scaled_pinv
from procedures.analysis.noise_fit.columns import allan_columns
from procedures.analysis.noise_fit.estimate import PROCESSES, Estimate, NoiseFit
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording

METHOD = "least_squares"
_FEWEST_POINTS = 6
_ITERATIONS = 50
_PER_DECADE = 2000
"""Frequencies of the integral; where the filters oscillate between them, they are a sample of its phase."""
_LIMIT = float(ndtri(0.95))


def fit_allan(deviation: Deviation, *, from_s: float = 0.0, level: float = 0.01, confidence: float = 0.95) -> NoiseFit:
    """Estimate Q, N, B, K, R from a rate's Allan deviation, overlapping or not, from the averaging time `from_s` on.

    A process is absent where its square is zero, or not significant at `level` (one-sided, normal); the least
    significant is left out first. Intervals are those of the squares. The slope's sign is not in an Allan variance:
    it is given as positive. Raises `BadParameter` and `UnfitRecording`.
    """
    if deviation.statistic.order != 2 or deviation.statistic.modified:
        raise BadParameter("statistic", deviation.statistic.name, "allan or overlapping_allan")
    for name, value in (("level", level), ("confidence", confidence)):
        if not 0.0 < value < 1.0:
            raise BadParameter(name, value, f"0 < {name} < 1")
    keep = deviation.tau_s >= from_s
    if np.sum(keep) < _FEWEST_POINTS:
        raise UnfitRecording(f"{np.sum(keep)} points from {from_s:g} s on: five coefficients take {_FEWEST_POINTS}")
    tau, edf = deviation.tau_s[keep], deviation.edf[keep]
    fit = _Fit(deviation.deviation[keep] ** 2, edf, allan_columns(tau))
    everything = tuple(range(len(PROCESSES)))
    full = fit.solve(everything)
    correlation = _correlation(deviation.sizes[keep].astype(np.float64), deviation.rate_hz, deviation.count, full)
    full_sd = np.sqrt(np.diag(fit.covariance(everything, full, correlation)))
    present, v, covariance = _significant(fit, correlation, float(ndtri(1.0 - level)))
    sd = dict(zip(present, np.sqrt(np.diag(covariance)), strict=True))
    z = float(ndtri(0.5 * (1.0 + confidence)))
    estimates = [
        _present(v[k], float(sd[k]), z) if k in present else _absent(full[k], float(full_sd[k])) for k in everything
    ]
    scale = np.array([sd[k] for k in present])
    return NoiseFit(
        METHOD,
        *estimates,
        slope=estimates[-1].value or 0.0,
        confidence=confidence,
        correlated=tuple(PROCESSES[k] for k in present),
        correlation=covariance / np.outer(scale, scale),
        octaves=(),
        lines=(),
        band_hz=(0.5 / float(tau[-1]), 0.5 / float(tau[0])),
        remarks=(),
    )


class _Fit:
    """Squares of the coefficients from σ² (k,), its degrees of freedom (k,) and unit columns (k, 5)."""

    def __init__(self, variance: Array, edf: Array, columns: Array) -> None:
        self._variance, self._edf, self._columns = variance, edf, columns

    def solve(self, present: tuple[int, ...]) -> Array:
        """Solve for the squares v, (5,), zero for absent processes."""
        # A counter that turns evenly can repeat its counts exactly over an averaging time: its σ² there is zero.
        least = np.min(self._variance, where=self._variance > 0.0, initial=np.inf)
        model, v = np.maximum(self._variance, least if np.isfinite(least) else 1.0), np.zeros(len(PROCESSES))
        for _ in range(_ITERATIONS):
            weight = np.sqrt(0.5 * self._edf) / model
            columns = self._columns[:, present] * weight[:, None]
            norm = np.sqrt(np.sum(columns**2, axis=0))
            before = v.copy()
            v[list(present)] = nnls(columns / norm, self._variance * weight)[0] / norm
            model = self._columns @ v
            if np.max(np.abs(self._columns @ (v - before)) / model) < 1e-9:
                break
        return v

    def covariance(self, present: tuple[int, ...], v: Array, correlation: Array) -> Array:
        """Covariance of the present elements of v, (p, p): the sandwich estimator at the model of v."""
        weight = np.sqrt(0.5 * self._edf) / (self._columns @ v)
        columns = self._columns[:, present] * weight[:, None]
        inverse = scaled_pinv(columns)
        return inverse @ correlation @ inverse.T


def _correlation(m: Array, rate_hz: float, count: int, v: Array) -> Array:
    """Correlation of the σ² at cluster sizes m, (k, k), for the spectrum of the squares v (5,) without the ramp."""
    decades = np.log10(0.5 * count)
    f = rate_hz * np.geomspace(0.25 / count, 0.5, int(_PER_DECADE * decades))
    sine = np.sin(pi * f / rate_hz)
    spectrum = 4.0 * rate_hz * sine**2 * v[0] + v[1] + v[2] / (2.0 * pi * f) + v[3] / (2.0 * pi * f) ** 2
    if not np.any(spectrum > 0.0):  # a bare ramp: any remaining noise counts as white
        spectrum = np.ones_like(f)
    root = spectrum * np.sqrt(f)  # df = f d ln f
    filters = np.sin(pi * f * m[:, None] / rate_hz)
    for _ in range(2):  # the fourth power: a power of another kind would take longer than the sines
        np.multiply(filters, filters, out=filters)
    filters *= root / sine**2
    filters /= np.sqrt(np.sum(filters**2, axis=1))[:, None]
    return filters @ filters.T


def _significant(fit: _Fit, correlation: Array, z: float) -> tuple[tuple[int, ...], Array, Array]:
    """The processes that exceed zero by z standard uncertainties, v (5,), and the covariance of theirs."""
    present = tuple(range(len(PROCESSES)))
    while True:
        v = fit.solve(present)
        covariance = fit.covariance(present, v, correlation)
        ratio = v[list(present)] / np.sqrt(np.diag(covariance))
        least = int(np.argmin(ratio))
        if ratio[least] >= z or len(present) == 1:
            return present, v, covariance
        present = present[:least] + present[least + 1 :]


def _present(v: float, sd: float, z: float) -> Estimate:
    value = sqrt(v)
    lower, upper = sqrt(max(0.0, v - z * sd)), sqrt(v + z * sd)
    return Estimate(value, 0.5 * sd / value, lower, upper, sqrt(v + _LIMIT * sd), _p_value(v / sd))


def _absent(v: float, sd: float) -> Estimate:
    """Estimate of an absent process, by the fit with all processes."""
    return Estimate(None, None, None, None, sqrt(v + _LIMIT * sd), _p_value(v / sd))


def _p_value(ratio: float) -> float:
    return 0.5 * erfc(ratio / sqrt(2.0))
