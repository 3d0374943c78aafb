"""Factor by which unknown noise must be scaled up before the residuals of a fit are likely."""

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import minimize_scalar

from procedures.core.arrays import Array

_GRID = 200
"""First search, evenly in the logarithm."""


def noise_factor(free: Array, noise: Array, of_table: Array) -> float:
    """The factor f ≥ 1 on the noise's covariance under which ``y ~ N(0, f·N + T)`` is most likely.

    `free` y (k,) has what no coefficient can explain, `noise` N and `of_table` T (k, k) its covariances by noise and by
    the table's flaws. Restricted maximum likelihood of one variance (Patterson and Thompson 1971): in the coordinates
    of ``T·u = λ·N·u`` it is the least ``Σ ln(f + λ) + z²/(f + λ)``. On an ideal table f = χ²/k, the usual scaling; on a
    real one each residual counts as far as noise could have made it, and flaws beyond the declared ones raise f as
    well where that is the likeliest.
    """
    if len(free) == 0:
        return 1.0
    size = np.sqrt(np.diagonal(noise))
    eigen, basis = eigh(of_table / np.outer(size, size), noise / np.outer(size, size))
    table, z2 = np.maximum(eigen, 0.0), (basis.T @ (free / size)) ** 2

    def unlikelihood(log_factor: float | Array) -> Array:
        total = np.exp(np.atleast_1d(log_factor))[:, None] + table
        return np.sum(np.log(total) + z2 / total, axis=1)

    grid = np.linspace(0.0, max(1.0, float(np.log(1.0 + z2.max()))), _GRID)
    best = int(np.argmin(unlikelihood(grid)))
    around = (float(grid[max(best - 1, 0)]), float(grid[min(best + 1, _GRID - 1)]))
    found = minimize_scalar(
        lambda x: float(unlikelihood(x)[0]), bounds=around, method="bounded", options={"xatol": 1e-9}
    )
    return 1.0 if best == 0 and unlikelihood(0.0)[0] <= found.fun else float(np.exp(found.x))
