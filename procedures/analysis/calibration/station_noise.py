"""Covariance of the mean outputs of one channel over several dwells, from the channel's noise coefficients.

A dwell is a window [start, stop] of time since launch. Slow processes tie the dwells of one launch together: their
common part goes into the bias, their differences into the scale factors. So the covariance is a full matrix, never a
diagonal.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from procedures.core.arrays import Array
from procedures.core.noise import NoiseCoefficients
from procedures.core.unit import TriadRecord

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
"""Gauss-Legendre nodes over ln(relaxation time): twelve e-folds of smooth integrand, good to about 1e-12."""


def mean_covariance(noise: NoiseCoefficients, windows: ArrayLike) -> Array:
    """Covariance of the means over n windows, shape (n, n) [rate²]; `windows` has shape (n, 2) [s since launch].

    ``C_ij = δ_ij·(2Q²/T_i² + N²/T_i) + flicker + K²·⟨min(t, u)⟩ + R²·t̄_i·t̄_j`` (thesis 3.2; IEEE Std 952 Annex C).
    Quantization: the two readings of the integrated output at the ends of the dwell. The rate ramp is a systematic
    effect: R stands for the standard deviation of an unknown slope.
    """
    spans = _spans(windows)
    lengths = spans[:, 1] - spans[:, 0]
    middles = spans.mean(axis=1)
    white = 2.0 * (noise.quantization / lengths) ** 2 + noise.random_walk**2 / lengths
    covariance = np.diag(white) + noise.rate_ramp**2 * np.outer(middles, middles)
    if noise.bias_instability > 0.0:
        covariance += flicker_covariance(noise, spans)
    if noise.rate_random_walk > 0.0:
        covariance += rate_random_walk_covariance(noise, spans)
    return covariance


def triad_covariance(record: TriadRecord | None, windows: ArrayLike) -> Array | None:
    """Return `mean_covariance` of the three channels, shape (3, n, n), or None where some channel's noise is not
    known.
    """
    if record is None:
        return None
    covariance = np.array([mean_covariance(noise, windows) for noise in record.noise])
    return covariance if np.all(np.diagonal(covariance, axis1=1, axis2=2) > 0.0) else None


def outputs_covariance(record: TriadRecord | None, output_unit: str, windows: ArrayLike) -> Array | None:
    """Return `triad_covariance` of outputs in their unit; None for counts too: a record has no noise in them."""
    return None if output_unit == "count" else triad_covariance(record, windows)


def flicker_covariance(noise: NoiseCoefficients, windows: ArrayLike) -> Array:
    """The bias instability's part, shape (n, n) [rate²].

    A Gauss-Markov process of variance s and relaxation time τ has ``s·∬exp(−|t−u|/τ)/(T_i·T_j)``, a second difference
    of ``τ²(e^(−x/τ) + x/τ − 1)``. The flicker process is their sum with ``s = (B²/π)·d ln τ`` over the band.
    """
    spans = _spans(windows)
    low_s, high_s = noise.flicker_band_s
    return noise.bias_instability**2 * _unit_flicker(low_s, high_s, tuple(spans.ravel().tolist()))


@lru_cache(maxsize=256)
def _unit_flicker(low_s: float, high_s: float, spans: tuple[float, ...]) -> Array:
    """Flicker covariance of B = 1 over a band of relaxation times [s]: the axes of a triad share it, (n, n)."""
    low, high = np.log((low_s, high_s))
    half = 0.5 * (high - low)
    relaxations = np.exp(0.5 * (high + low) + half * _NODES)
    return _double_mean(np.reshape(spans, (-1, 2)), _gauss_markov(relaxations, half * _WEIGHTS / np.pi))


def rate_random_walk_covariance(noise: NoiseCoefficients, windows: ArrayLike) -> Array:
    """The rate random walk's part, zero at launch, shape (n, n) [rate²].

    ``K²·⟨min(t, u)⟩ = K²·(t̄_i + t̄_j − ⟨|t − u|⟩)/2``, with ``⟨|t − u|⟩`` a second difference of ``|x|³/6``.
    """
    spans = _spans(windows)
    middles = spans.mean(axis=1)
    distance = _double_mean(spans, lambda x: np.abs(x) ** 3 / 6.0)
    return noise.rate_random_walk**2 * 0.5 * (middles[:, None] + middles[None, :] - distance)


def _gauss_markov(relaxations_s: Array, variances: Array) -> Callable[[Array], Array]:
    """F with F'' the correlation of a sum of Gauss-Markov processes, both arguments (m,)."""

    def twice_integrated(x: Array) -> Array:
        y = np.abs(x) / relaxations_s[:, None, None]
        return np.tensordot(variances * relaxations_s**2, np.expm1(-y) + y, axes=1)

    return twice_integrated


def _double_mean(spans: Array, twice_integrated: Callable[[Array], Array]) -> Array:
    """Mean of f(t − u) over t in window i and u in window j, from F with F'' = f and F even, shape (n, n)."""
    start, stop = spans[:, 0], spans[:, 1]
    lengths = stop - start
    integral = (
        twice_integrated(stop[:, None] - start[None, :])
        + twice_integrated(start[:, None] - stop[None, :])
        - twice_integrated(start[:, None] - start[None, :])
        - twice_integrated(stop[:, None] - stop[None, :])
    )
    return integral / np.outer(lengths, lengths)


def _spans(windows: ArrayLike) -> Array:
    spans = np.asarray(windows, dtype=np.float64).reshape(-1, 2)
    if not np.all(np.isfinite(spans)) or np.any(spans[:, 0] < 0.0) or np.any(spans[:, 1] <= spans[:, 0]):
        raise ValueError("windows must be 0 ≤ start < stop, finite, in seconds since launch")
    return spans
