"""Pseudo-inverse that does not depend on the units of the unknowns."""

import numpy as np

from procedures.core.arrays import Array


def scaled_pinv(design: Array) -> Array:
    """Pseudo-inverse (k, n) of a design (n, k), with columns that may differ by orders of magnitude.

    Each column is scaled to unit length first, so that the cut of small singular values is the same in all units; a
    column of zeros gives a row of zeros.
    """
    lengths = np.linalg.norm(design, axis=0)
    lengths[lengths == 0.0] = 1.0
    return np.asarray(np.linalg.pinv(design / lengths), dtype=np.float64) / lengths[:, None]
