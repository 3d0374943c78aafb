"""Least squares with correlated residuals: whitened by the noise's own spectrum, run by run.

Residuals of thermal fits are not independent: an accelerometer's flicker lasts for hours. Cosines of a run are all
but uncorrelated, with variances that the noise model of IEEE Std 952 gives (`coloured_noise`): Q, N, B and K are the
most likely ones of the residuals, and dividing by the roots of the variances whitens. Tried beforehand: an
autoregression of six minutes left the claimed uncertainties of the linear coefficients a factor of two too small.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import dct

from procedures.analysis.coloured_noise import FEWEST, cosines, fit_noise, unit_variances
from procedures.analysis.least_squares.inverse import scaled_pinv
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.noise import NoiseCoefficients

SLOW = 10
"""Cosines up to this number carry a cycle's temperature: there the noise is expressed as effective samples."""
EXACT = 1e-24
"""Power of the residuals relative to the values' below which a fit is exact to rounding and shows no noise."""


@dataclass(frozen=True)
class Spectrum:
    """Noise of several runs with the variances of their cosines."""

    noise: NoiseCoefficients
    """Noise of the residuals, weighted where the fit weighted them."""
    variances: tuple[Array, ...]
    """Variances of the cosines k = 0 … n − 1 of each run, (n,). The mean's is unknown and takes that of k = 1: each run
    has an intercept of its own, so no slope is affected."""

    @property
    def inflation(self) -> float:
        """Variance of the slowest `SLOW` cosines over that of independent values of the same spread, at least one."""
        return max(1.0, float(np.mean([np.mean(v[:SLOW]) / np.mean(v) for v in self.variances])))


def spectrum(residuals: Sequence[Array], cell_s: float) -> Spectrum:
    """Fit one noise to the residuals (n_r,) of several runs of cells of `cell_s` [s]. Raises `UnfitRecording`.

    Runs of different lengths are cut to the shortest for the fit; all of each is whitened.
    """
    shortest = min(len(r) for r in residuals)
    if shortest < FEWEST:
        raise UnfitRecording(f"a run of {shortest} cells is too short to estimate its noise; the least is {FEWEST}")
    power = np.mean([cosines(r[:shortest]) ** 2 for r in residuals], axis=0)
    if not np.any(power):
        raise UnfitRecording("the residuals are exactly zero: there is no noise to estimate")
    noise = fit_noise(np.sqrt(power), unit_variances(shortest, cell_s)).noise
    squares = np.square([noise.quantization, noise.random_walk, noise.bias_instability, noise.rate_random_walk])
    variances = [squares @ unit_variances(len(r), cell_s) for r in residuals]
    return Spectrum(noise, tuple(np.concatenate([v[:1], v]) for v in variances))


def whiten(values: Array, variances: Array) -> Array:
    """Return the cosines of values (n,) or columns (n, m) over the roots of their variances (n,): as long, and
    white.
    """
    over = 1.0 / np.sqrt(variances)
    turned = np.asarray(dct(values, type=2, norm="ortho", axis=0), dtype=np.float64)
    return turned * (over if values.ndim == 1 else over[:, None])


@dataclass(frozen=True)
class LinearFit:
    """Least squares of several runs with one noise."""

    coefficients: Array
    """Fitted coefficients, shape (k,)."""
    covariance: Array
    """Covariance of the coefficients, shape (k, k)."""
    spectrum: Spectrum | None
    """Spectrum of the weighted residuals; None where the fit is exact to rounding."""
    residuals: tuple[Array, ...]
    """Residuals of each run, not whitened."""
    effective_samples: float
    """Cells over the spectrum's inflation."""
    whitened: bool
    """True if the answer is that of whitened cells; False if of the cells as they are."""

    @property
    def degrees_of_freedom(self) -> float:
        """Degrees of freedom of the intervals: effective samples less coefficients, at least one."""
        return max(1.0, self.effective_samples - len(self.coefficients))


def fit_linear(
    designs: Sequence[Array],
    values: Sequence[Array],
    weights: Sequence[Array],
    cell_s: float,
    *,
    generalised: bool = True,
    passes: int = 2,
) -> LinearFit:
    """Fit values (n_r,) of each run r by designs (n_r, k); `weights` (n_r,) are inverse relative standard deviations.

    `generalised`: weighted least squares gives residuals, these a noise, this the weights of generalised least squares,
    `passes` times; covariance ``(AᵀS⁻¹A)⁻¹``. Else weighted least squares is the answer, for models that are known to
    miss something, with the covariance ``P·S·Pᵀ`` of its pseudo-inverse P. Raises `UnfitRecording`.
    """
    count, wanted = sum(len(y) for y in values), designs[0].shape[1]
    if count <= wanted:
        raise UnfitRecording(f"{count} cells cannot determine {wanted} coefficients")
    scaled = [(w[:, None] * a, w * y) for a, y, w in zip(designs, values, weights, strict=True)]
    inverse = scaled_pinv(np.concatenate([a for a, _ in scaled]))
    solution = inverse @ np.concatenate([y for _, y in scaled])
    found: Spectrum | None = None
    covariance = np.zeros((wanted, wanted))
    for _ in range(passes if generalised else 1):
        left = [y - a @ solution for a, y in scaled]
        if sum(float(r @ r) for r in left) <= EXACT * sum(float(y @ y) for _, y in scaled):
            break
        found = spectrum(left, cell_s)
        if generalised:
            whitened = [(whiten(a, v), whiten(y, v)) for (a, y), v in zip(scaled, found.variances, strict=True)]
            inverse = scaled_pinv(np.concatenate([a for a, _ in whitened]))
            solution = inverse @ np.concatenate([y for _, y in whitened])
            covariance = inverse @ inverse.T
        else:
            covariance = _sandwich(inverse, found)
    return LinearFit(
        solution,
        covariance,
        found,
        tuple(y - a @ solution for a, y in zip(designs, values, strict=True)),
        count / (found.inflation if found else 1.0),
        generalised,
    )


def _sandwich(inverse: Array, found: Spectrum) -> Array:
    """``P·S·Pᵀ``, S diagonal among the cosines of each run, (k, k)."""
    total, at = np.zeros((len(inverse), len(inverse))), 0
    for variances in found.variances:
        part = np.asarray(dct(inverse[:, at : at + len(variances)].T, type=2, norm="ortho", axis=0), dtype=np.float64)
        total += (part * variances[:, None]).T @ part
        at += len(variances)
    return total
