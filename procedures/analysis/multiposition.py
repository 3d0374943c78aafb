"""Calibration of a triad from known vectors at many orientations: generalised least squares, channel by channel.

``[1 v_x v_y v_z]·[b K_i1 K_i2 K_i3]ᵀ = U_i`` (thesis 3.31, 3.35 and the solution of 3.3.6), weighted by the covariance
of the station means. The uncertainty has two parts: the unit's noise, and the table that set the vectors.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space
from scipy.special import chdtrc

from procedures.analysis.determination import require_full_rank
from procedures.analysis.table_errors import SOURCES, TableErrors
from procedures.analysis.whitening import whitener
from procedures.core.arrays import Array
from procedures.core.imu_model import TriadCalibration, triad_calibration


@dataclass(frozen=True)
class Estimator:
    """The linear estimator of a plan: what it multiplies the outputs with, and what noise does to the answer."""

    design: Array
    """[1 v_x v_y v_z], shape (n, 4)."""
    gain: Array
    """Coefficients = gain·outputs, per channel, shape (3, 4, n)."""
    noise_covariance: Array
    """Of the twelve coefficients, channel by channel, shape (12, 12)."""
    condition: float
    """Condition number of the column-scaled design."""


@dataclass(frozen=True)
class TableShare:
    """What the table's flaws add to the twelve coefficients."""

    per_sd: Array
    """Change of the coefficients per standard deviation of each flaw, shape (12, P)."""
    source: tuple[str, ...]

    @property
    def covariance(self) -> Array:
        """Shape (12, 12)."""
        return self.per_sd @ self.per_sd.T

    def standard_uncertainty(self, source: str) -> Array:
        """Of the twelve coefficients from one source alone, shape (12,)."""
        columns = np.array([s == source for s in self.source], dtype=bool)
        return np.sqrt(np.sum(self.per_sd[:, columns] ** 2, axis=1))

    def by_source(self) -> dict[str, Array]:
        """Standard uncertainties (12,) of every source that contributes."""
        parts = {source: self.standard_uncertainty(source) for source in SOURCES}
        return {source: part for source, part in parts.items() if np.any(part > 0.0)}


@dataclass(frozen=True)
class TriadFit:
    """Coefficients of a triad, their uncertainty in two parts, and how well the model describes the stations."""

    triad: str
    output_unit: str
    input_unit: str
    coefficients: Array
    """Shape (12,), in the order of `COEFFICIENT_NAMES`."""
    noise_covariance: Array
    table: TableShare
    condition: float
    residuals: Array
    """Outputs minus model, shape (n, 3), in the output's unit."""
    residual_sd: Array
    """Their expected standard deviations, table included, shape (n, 3)."""
    magnitude_sd: Array
    """Expected standard deviations of |v̂| − |v| at the same stations, SI, shape (n,)."""
    chi_square: float
    degrees_of_freedom: int
    noise_known: bool
    """False where the noise was estimated from the recordings themselves: then chi-square proves nothing."""

    @property
    def covariance(self) -> Array:
        """Noise and table together, shape (12, 12)."""
        return self.noise_covariance + self.table.covariance

    @property
    def matrix(self) -> Array:
        """K, shape (3, 3)."""
        return self.coefficients.reshape(3, 4)[:, 1:]

    @property
    def p_value(self) -> float | None:
        """Chance of a chi-square at least as large, where it can be judged."""
        if not self.noise_known or self.degrees_of_freedom == 0:
            return None
        return float(chdtrc(self.degrees_of_freedom, self.chi_square))

    def calibration(self) -> TriadCalibration:
        """The coefficients with their total covariance, ready to correct with."""
        return triad_calibration(self.triad, self.output_unit, self.input_unit, self.coefficients, self.covariance)


def estimator(what: str, vectors: Array, noise_covariance: Array) -> Estimator:
    """Generalised least squares for input vectors (n, 3) and covariances of the station means (3, n, n).

    ``x̂ = (AᵀC⁻¹A)⁻¹AᵀC⁻¹·U`` per channel. Raises `Undetermined` naming the lost combinations.
    """
    design = np.column_stack([np.ones(len(vectors)), vectors])
    condition = require_full_rank(what, design, ("b_i", "K_i1", "K_i2", "K_i3"))
    scale = np.linalg.norm(design, axis=0)
    gains, covariance = [], np.zeros((12, 12))
    for channel, c in enumerate(noise_covariance):
        weights = whitener(c)
        pseudo_inverse = np.linalg.pinv(weights @ design / scale) / scale[:, None]
        gains.append(pseudo_inverse @ weights)
        covariance[4 * channel : 4 * channel + 4, 4 * channel : 4 * channel + 4] = pseudo_inverse @ pseudo_inverse.T
    return Estimator(design, np.array(gains), covariance, condition)


def table_share(plan: Estimator, table: TableErrors, matrix: Array) -> TableShare:
    """The table's flaws carried through the outputs ``K·δv`` and the estimator into the coefficients."""
    per_sd = np.einsum("can,ncp->cap", plan.gain, table.of_outputs(matrix))
    return TableShare(per_sd.reshape(12, -1), table.source)


def fit_triad(
    triad: str,
    output_unit: str,
    input_unit: str,
    vectors: Array,
    outputs: Array,
    noise_covariance: Array,
    table: TableErrors,
    noise_known: bool = True,
) -> TriadFit:
    """Fit one triad's outputs (n, 3) at input vectors (n, 3); `noise_covariance` of the means has shape (3, n, n).

    Where the noise is not known (`noise_known` False) its covariance is a first estimate from the dwells and is scaled
    up to what the residuals show, never down.
    """
    plan = estimator(f"the {triad} coefficients", vectors, noise_covariance)
    by_channel = np.einsum("can,nc->ca", plan.gain, outputs)
    residuals = outputs - plan.design @ by_channel.T
    of_table = table.of_outputs(by_channel[:, 1:])
    chi_square, degrees = _chi_square(plan.design, outputs, noise_covariance, of_table)
    factor = 1.0 if noise_known or degrees == 0 else max(1.0, chi_square / degrees)
    residual_variance, residual_flaws = _residual_parts(plan, noise_covariance * factor, of_table)
    weights = vectors / np.linalg.norm(vectors, axis=1)[:, None] @ np.linalg.inv(by_channel[:, 1:])
    along = np.einsum("nc,ncp->np", weights, residual_flaws)
    return TriadFit(
        triad,
        output_unit,
        input_unit,
        by_channel.ravel(),
        plan.noise_covariance * factor,
        table_share(plan, table, by_channel[:, 1:]),
        plan.condition,
        residuals,
        np.sqrt(residual_variance + np.sum(residual_flaws**2, axis=2)),
        np.sqrt(np.sum(weights**2 * residual_variance, axis=1) + np.sum(along**2, axis=1)),
        chi_square,
        degrees,
        noise_known,
    )


def _chi_square(design: Array, outputs: Array, noise_covariance: Array, of_table: Array) -> tuple[float, int]:
    """What no coefficient can explain against its full covariance, noise and table, all three channels together.

    With Z an orthonormal basis of the complement of the design, ``y = ZᵀU`` is free of the coefficients and
    ``χ² = yᵀ·cov(y)⁻¹·y`` has 3(n − 4) degrees of freedom.
    """
    free = null_space((design / np.linalg.norm(design, axis=0)).T)
    degrees = 3 * free.shape[1]
    if degrees == 0:
        return 0.0, 0
    y = (free.T @ outputs).T.ravel()
    flaws = np.einsum("nk,ncp->ckp", free, of_table).reshape(degrees, -1)
    covariance = flaws @ flaws.T
    k = free.shape[1]
    for channel, c in enumerate(noise_covariance):
        covariance[channel * k : channel * k + k, channel * k : channel * k + k] += free.T @ c @ free
    whitened = whitener(covariance) @ y
    return float(whitened @ whitened), degrees


def _residual_parts(plan: Estimator, noise_covariance: Array, of_table: Array) -> tuple[Array, Array]:
    """What the residuals ``(I − A·G)·U`` should be: variance of noise (n, 3), change per sd of each flaw (n, 3, P)."""
    variances, flaws = [], []
    for channel, (gain, c) in enumerate(zip(plan.gain, noise_covariance, strict=True)):
        remaining = np.eye(len(plan.design)) - plan.design @ gain
        variances.append(np.maximum(np.diagonal(remaining @ c @ remaining.T), 0.0))
        flaws.append(remaining @ of_table[:, channel])
    return np.array(variances).T, np.stack(flaws, axis=1)


def joint_table_covariance(gyro: TableShare, accelerometer: TableShare) -> Array:
    """Covariance of all twenty-four coefficients from the table's flaws, which both triads share, shape (24, 24)."""
    both = np.vstack([gyro.per_sd, accelerometer.per_sd])
    return both @ both.T
