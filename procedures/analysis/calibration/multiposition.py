"""Calibration of a triad from known vectors at many orientations: generalised least squares.

``[1 v_x v_y v_z]·[b K_i1 K_i2 K_i3]ᵀ = U_i`` (thesis 3.31, 3.35 and the solution of 3.3.6), weighted by the covariance
of the station means and, by default, of the table's flaws. The uncertainty has these two parts: the unit's
noise, and the table that set the vectors.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, null_space

from procedures.analysis.calibration.estimator import Estimator, TableShare, Weighting, estimator, table_share
from procedures.analysis.calibration.magnitude import in_sample_gain, magnitude_gradient
from procedures.analysis.calibration.noise_scale import noise_factor
from procedures.analysis.calibration.suspect_flaw import FreeResiduals, free_residuals
from procedures.analysis.calibration.table_errors import TableErrors
from procedures.analysis.least_squares.chi_square import chi_square, judged_p_value
from procedures.core.arrays import Array
from procedures.core.imu_model import TriadCalibration, triad_calibration


@dataclass(frozen=True)
class TriadFit:
    """Coefficients of a triad, their uncertainty in two parts, and the goodness of fit at the stations."""

    triad: str
    output_unit: str
    input_unit: str
    weighting: Weighting
    coefficients: Array
    """Shape (12,), in the order of `COEFFICIENT_NAMES`."""
    estimator: Estimator
    """The linear estimator that gave the coefficients."""
    table: TableShare
    station_noise: Array
    """Covariance of the station means, scaled up where it was not known, (3, n, n)."""
    of_table: Array
    """Change of the outputs per standard deviation of each flaw, (n, 3, P)."""
    residuals: Array
    """Outputs minus model, shape (n, 3), in the output's unit."""
    residual_sd: Array
    """Their expected standard deviations, table included, shape (n, 3)."""
    magnitude_sd: Array
    """Expected standard deviations of |v̂| − |v| at the same stations, SI, shape (n,)."""
    chi_square: float
    """Chi-square of the part of the outputs that no coefficient can explain, against noise and table together."""
    degrees_of_freedom: int
    noise_known: bool
    """False where the noise was estimated from the recordings themselves: then chi-square proves nothing."""
    free: FreeResiduals | None = None
    """Residuals without what coefficients can explain; None where no equation is spare, or the noise is not known."""

    @property
    def noise_covariance(self) -> Array:
        """Covariance of the twelve coefficients from noise, shape (12, 12)."""
        return self.estimator.noise_covariance

    @property
    def covariance(self) -> Array:
        """Noise and table together, shape (12, 12); weighted by both it is ``(AᵀS⁻¹A)⁻¹``."""
        return self.noise_covariance + self.table.covariance

    @property
    def condition(self) -> float:
        """Condition number of the column-scaled design."""
        return self.estimator.condition

    @property
    def matrix(self) -> Array:
        """Matrix K of the triad, shape (3, 3)."""
        return self.coefficients.reshape(3, 4)[:, 1:]

    @property
    def p_value(self) -> float | None:
        """Probability of a chi-square at least as large; None where it cannot be judged."""
        return judged_p_value(self.chi_square, self.degrees_of_freedom, self.noise_known)

    def calibration(self) -> TriadCalibration:
        """Return the coefficients with their total covariance, as a calibration to correct with."""
        return triad_calibration(self.triad, self.output_unit, self.input_unit, self.coefficients, self.covariance)


def fit_triad(
    triad: str,
    output_unit: str,
    input_unit: str,
    vectors: Array,
    outputs: Array,
    noise_covariance: Array,
    table: TableErrors,
    noise_known: bool = True,
    weighting: Weighting = "noise_and_table",
) -> TriadFit:
    """Fit one triad's outputs (n, 3) at input vectors (n, 3); `noise_covariance` of the means has shape (3, n, n).

    The flaws act through K, which least squares with the noise's weights gives first; weights and uncertainties of the
    answer are made with that K, since another pass would change nothing that can be seen (`tests/domain`). Where the
    noise is not known (`noise_known` False) its covariance is a first estimate from the dwells and is scaled up to what
    the residuals show, never down.
    """
    what = f"the {triad} coefficients"
    plan = estimator(what, vectors, noise_covariance)
    of_table = table.of_outputs(plan.coefficients(outputs).reshape(3, 4)[:, 1:])
    free, of_noise, of_flaws, basis = _free_of_coefficients(plan.design, outputs, noise_covariance, of_table)
    factor = 1.0 if noise_known else noise_factor(free, of_noise, of_flaws)
    if weighting == "noise_and_table" or factor > 1.0:
        flaws = of_table if weighting == "noise_and_table" else None
        plan = estimator(what, vectors, noise_covariance * factor, flaws)
    coefficients = plan.coefficients(outputs)
    matrix = coefficients.reshape(3, 4)[:, 1:]
    residual_sd, magnitude_sd = _expected(plan, vectors, matrix, noise_covariance * factor, of_table)
    square = chi_square(free, of_noise + of_flaws)
    return TriadFit(
        triad,
        output_unit,
        input_unit,
        weighting,
        coefficients,
        plan,
        table_share(plan, of_table, table, matrix),
        noise_covariance * factor,
        of_table,
        outputs - plan.modelled(coefficients),
        residual_sd,
        magnitude_sd,
        square,
        len(free),
        noise_known,
        free_residuals(free, of_noise + of_flaws, basis, matrix, table) if noise_known and len(free) > 0 else None,
    )


def _free_of_coefficients(
    design: Array, outputs: Array, noise_covariance: Array, of_table: Array
) -> tuple[Array, Array, Array, Array]:
    """Residual combinations y (k,) of all three channels, free of coefficients, their (k, k) noise and table parts, Z.

    ``y = ZᵀU`` with Z an orthonormal basis of the complement of the design, k = 3(n − 4). It does not depend on the
    weights.
    """
    basis = null_space((design / np.linalg.norm(design, axis=0)).T)
    flaws = np.einsum("nk,ncp->ckp", basis, of_table).reshape(3 * basis.shape[1], of_table.shape[2])
    of_noise = block_diag(*[basis.T @ c @ basis for c in noise_covariance])
    return (basis.T @ outputs).T.ravel(), of_noise, flaws @ flaws.T, basis


def _expected(
    plan: Estimator, vectors: Array, matrix: Array, noise_covariance: Array, of_table: Array
) -> tuple[Array, Array]:
    """Standard deviations of the residuals ``(1 − A·G)·U`` (n, 3) and of |v̂| − |v|, their part along v̂, (n,)."""
    n = len(vectors)
    flaws = of_table.transpose(1, 0, 2).reshape(3 * n, -1)
    remaining = plan.remaining()
    gradient = magnitude_gradient(vectors, np.linalg.inv(matrix))
    along = in_sample_gain(gradient, remaining)

    def sd(rows: Array) -> Array:
        noise = np.einsum("kci,cij,kcj->k", rows.reshape(-1, 3, n), noise_covariance, rows.reshape(-1, 3, n))
        return np.sqrt(np.maximum(noise, 0.0) + np.sum((rows @ flaws) ** 2, axis=1))

    return sd(remaining).reshape(3, n).T, sd(along)
