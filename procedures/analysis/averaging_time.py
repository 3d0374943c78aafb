"""Averaging time after which quantization no longer dominates a mean (thesis 4.1.2, 4.1.3): a crossing of lines."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil, log, pi, sqrt

import numpy as np
from scipy.optimize import brentq

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.noise import NoiseCoefficients

_FLICKER = 2.0 * log(2.0) / pi


@dataclass(frozen=True)
class AveragingTime:
    """Averaging time at which the quantization line falls below the rest of the noise, with its uncertainty."""

    tau_s: float | None
    """Crossing time; None where there is no other noise, 0 where there is no quantization."""
    sd_s: float | None
    """Standard uncertainty; None without that of the coefficients, or without a crossing."""
    deviation: float | None
    """Allan deviation of the whole noise there [rate]; quantization and the rest contribute √½ of it each."""


def allan_variance(noise: NoiseCoefficients, tau_s: float) -> float:
    """Allan variance ``3Q²/τ² + N²/τ + (2 ln 2/π)B² + K²τ/3 + R²τ²/2`` [rate²] (thesis 3.2; IEEE Std 952 Annex C).

    Raises `BadParameter` for an averaging time that is not above 0.
    """
    if not 0.0 < tau_s < float("inf"):
        raise BadParameter("tau_s", tau_s, "finite and above 0 s")
    return 3.0 * (noise.quantization / tau_s) ** 2 + _rest(noise, tau_s)


def averaging_time(noise: NoiseCoefficients, covariance: Array | None = None) -> AveragingTime:
    """The only root of ``3Q²/τ² = N²/τ + (2 ln 2/π)B² + K²τ/3 + R²τ²/2``: the right side falls slower.

    `covariance` (5, 5), of the coefficients in the order Q, N, B, K, R, each in its own unit (`core.noise`), gives the
    standard uncertainty: with ``g = ln(3Q²/τ²) − ln(rest)`` linear in small errors, ``u² = (∂g/∂θ)ᵀC(∂g/∂θ)/(dg/dτ)²``.
    Raises `BadParameter` where the matrix is no covariance.
    """
    if covariance is not None:
        _check(covariance)
    coefficients = (noise.random_walk, noise.bias_instability, noise.rate_random_walk, noise.rate_ramp)
    q = noise.quantization
    if q == 0.0:
        return AveragingTime(0.0 if any(coefficients) else None, None, None)
    if not any(coefficients):
        return AveragingTime(None, None, None)

    # each part alone crosses at one of these; the crossing with their sum lies below the least, by at most four shares
    powers, sizes = (1.0, 2.0, 3.0, 4.0), (1.0, _FLICKER, 1.0 / 3.0, 0.5)
    alone = [
        (3.0 * q**2 / (size * c**2)) ** (1.0 / power)
        for c, power, size in zip(coefficients, powers, sizes, strict=True)
        if c > 0.0
    ]
    high = min(alone)

    def excess(ln_tau: float) -> float:
        tau = float(np.exp(ln_tau))
        return log(3.0) + 2.0 * log(q / tau) - log(_rest(noise, tau))

    tau = float(np.exp(brentq(excess, log(high) - log(4.0) - 1e-6, log(high) + 1e-6, xtol=1e-13)))
    rest = _rest(noise, tau)
    deviation = sqrt(3.0 * (q / tau) ** 2 + rest)
    if covariance is None:
        return AveragingTime(tau, None, deviation)
    by_part = tau ** np.array([-1.0, 0.0, 1.0, 2.0]) * np.array(sizes) * np.array(coefficients)
    gradient = np.concatenate([[2.0 / q], -2.0 * by_part / rest])
    growth = float(np.dot(by_part * np.array(coefficients), [-1.0, 0.0, 1.0, 2.0])) / (rest * tau)
    variance = float(gradient @ covariance @ gradient)
    return AveragingTime(tau, sqrt(variance) / (2.0 / tau + growth), deviation)


def dwell(times: Iterable[AveragingTime], step_s: float) -> float | None:
    """Return the averaging time of a unit [s]: the longest of its channels', rounded up to whole steps; None where a
    channel has none.

    Thesis 4.1.3: gyros 55 s, accelerometers 65 s, hence 70 s an orientation. Raises `BadParameter` for a step that is
    not above 0, and for no channel.
    """
    if not 0.0 < step_s < float("inf"):
        raise BadParameter("step_s", step_s, "finite and above 0 s")
    channels = [time.tau_s for time in times]
    if not channels:
        raise BadParameter("times", channels, "at least one channel")
    longest = 0.0
    for tau in channels:
        if tau is None:
            return None
        longest = max(longest, tau)
    return step_s * max(1, ceil(longest / step_s - 1e-9))


def _rest(noise: NoiseCoefficients, tau_s: float) -> float:
    return (
        noise.random_walk**2 / tau_s
        + _FLICKER * noise.bias_instability**2
        + noise.rate_random_walk**2 * tau_s / 3.0
        + (noise.rate_ramp * tau_s) ** 2 / 2.0
    )


def _check(covariance: Array) -> None:
    if covariance.shape != (5, 5) or not np.all(np.isfinite(covariance)):
        raise BadParameter("covariance", covariance.shape, "finite, of shape (5, 5)")
    variances = np.diagonal(covariance)
    uneven = np.abs(covariance - covariance.T) > 1e-9 * np.sqrt(np.abs(np.outer(variances, variances)))
    if np.any(variances < 0.0) or np.any(uneven):
        raise BadParameter("covariance", covariance.tolist(), "symmetric, with no negative variance")
