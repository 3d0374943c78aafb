"""Error of a corrected vector's magnitude due to errors of the outputs that it was corrected from."""

import numpy as np
from numpy.typing import ArrayLike

from procedures.core.arrays import Array


def magnitude_gradient(vectors: Array, correction: ArrayLike) -> Array:
    """Return ``∂|v̂|/∂U = K⁻ᵀ·v/|v|`` at vectors (n, 3) for the correction K⁻¹ (3, 3), shape (n, 3)."""
    return vectors / np.linalg.norm(vectors, axis=1)[:, None] @ np.asarray(correction, dtype=np.float64)


def in_sample_gain(gradient: Array, remaining: Array) -> Array:
    """Change of |v̂| − |v| at the stations of a calibration per output, all stacked channel by channel, (n, 3n).

    The calibration follows its own outputs, so only ``w·(1 − A·G)·δU`` of an error δU is left in the magnitude:
    `gradient` w (n, 3), `remaining` the estimator's residual operator (3n, 3n).
    """
    n = len(gradient)
    return np.einsum("nc,cnj->nj", gradient, remaining.reshape(3, n, 3 * n))


def magnitude_covariance(gradient: Array, covariance: Array) -> Array:
    """Return the covariance (n, n) of magnitudes with gradient w (n, 3), for the channels' covariances (3, n, n).

    ``Σ_c diag(w_c)·C_c·diag(w_c)``.
    """
    return np.einsum("ic,cij,jc->ij", gradient, covariance, gradient)
