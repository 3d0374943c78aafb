"""Whitening weights from a covariance matrix."""

import numpy as np
from scipy.linalg import cholesky

from procedures.core.arrays import Array


def whitener(covariance: Array) -> Array:
    """W with ``W·C·Wᵀ = 1`` and ``WᵀW = C⁻¹``, shape (n, n): the inverse of the Cholesky factor of C.

    C is first scaled to a unit diagonal, so that outputs of very different size may stand side by side.
    """
    size = np.sqrt(np.diagonal(covariance))
    factor = cholesky(covariance / np.outer(size, size), lower=True)
    return np.asarray(np.linalg.inv(factor), dtype=np.float64) / size


def whiteners(covariances: Array) -> Array:
    """Return the `whitener` of each of several covariances at once, shape (k, n, n)."""
    size = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    factors = np.linalg.cholesky(covariances / (size[:, :, None] * size[:, None, :]))
    return np.asarray(np.linalg.inv(factors), dtype=np.float64) / size[:, None, :]
