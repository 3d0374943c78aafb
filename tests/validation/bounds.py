"""The least uncertainty that any unbiased estimator could have from a plan: the measure of the estimators in use."""

import numpy as np
from scipy.linalg import block_diag

from procedures.analysis.calibration.estimator import estimator
from procedures.analysis.calibration.table_errors import TableErrors
from procedures.analysis.least_squares.inverse import scaled_pinv
from procedures.analysis.least_squares.whitening import whitener
from procedures.core.arrays import Array


def cramer_rao_bound(vectors: Array, noise_covariance: Array) -> Array:
    """Bound (12, 12) on a triad's coefficients for Gaussian noise of covariances (3, n, n) and an ideal table.

    ``(AᵀC⁻¹A)⁻¹`` per channel: what generalised least squares reaches.
    """
    return estimator("the coefficients", vectors, noise_covariance).noise_covariance


def bayesian_bound(
    vectors: tuple[Array, Array],
    noise_covariance: tuple[Array, Array],
    table: tuple[TableErrors, TableErrors],
    matrices: tuple[Array, Array],
) -> Array:
    """Bound (24, 24) on both triads' coefficients when the table's flaws are unknown with their stated priors.

    The flaws are marginalised over both triads at once: the accelerometers see the same tilt of the table as the gyros.
    ``(AᵀS⁻¹A)⁻¹`` with ``S = C + J·Σ_p·Jᵀ`` over all six channels, which equals the Schur complement of the joint
    information.
    """
    designs, noise, flaws = [], [], []
    for v, c, errors, matrix in zip(vectors, noise_covariance, table, matrices, strict=True):
        designs += [np.column_stack([np.ones(len(v)), v])] * 3
        noise += list(c)
        flaws.append(errors.of_outputs(matrix).transpose(1, 0, 2).reshape(3 * len(v), -1))
    total = block_diag(*noise) + np.vstack(flaws) @ np.vstack(flaws).T
    whitened = whitener(total) @ block_diag(*designs)
    inverse = scaled_pinv(whitened)
    return inverse @ inverse.T
