"""The ellipsoid through points, by linear least squares."""

import numpy as np

from procedures.core.arrays import Array


def ellipsoid(points: Array) -> tuple[Array, Array] | None:
    """Return centre c (3,) and upper triangular R (3, 3) of ``|R·(u − c)| = 1`` through points (n, 3), n ≥ 9.

    Solves ``uᵀQu + qᵀu = 1`` for Q and q; with c = −Q⁻¹q/2 then ``RᵀR = Q/(1 + cᵀQc)``. None where Q is not positive
    definite: the points lie on no ellipsoid, or on one that does not enclose the origin.
    """
    unit = float(np.abs(points).max())
    if unit == 0.0:
        return None
    x, y, z = (points / unit).T
    design = np.column_stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z, x, y, z])
    p = np.linalg.lstsq(design, np.ones(len(points)), rcond=None)[0]
    q = np.array([[p[0], p[3], p[4]], [p[3], p[1], p[5]], [p[4], p[5], p[2]]])
    if not np.all(np.linalg.eigvalsh(q) > 0.0):
        return None
    centre: Array = (-0.5 * np.linalg.solve(q, p[6:])).astype(np.float64)
    factor = np.linalg.cholesky(q / (1.0 + float(centre @ q @ centre))).T / unit
    return centre * unit, np.asarray(factor, dtype=np.float64)
