"""Orientations with the least predicted uncertainty: exchange of stations over a grid, then a smooth descent.

The exchange (Fedorov 1972; Cook and Nachtsheim 1980) replaces one station after the other by the best of the grid until
none can be bettered; it begins several times, from points of a Halton sequence, so that no chance is in it. The
descent is scipy's L-BFGS-B within the table's limits.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.orientation_plan.information import Objective, information, prior
from procedures.core.arrays import Array
from procedures.importing import IMPORTING

Indices = NDArray[np.int64]

_STEP_DEG = 1e-3
"""Step of the central differences [deg]."""


@dataclass(frozen=True)
class SearchSettings:
    """Effort of the search. The defaults take a few seconds a plan."""

    minimum_deg: tuple[float, float, float] = (-180.0, -180.0, -180.0)
    maximum_deg: tuple[float, float, float] = (180.0, 180.0, 180.0)
    grid_deg: float = 45.0
    starts: int = 4
    sweeps: int = 8
    iterations: int = 60


def grid(settings: SearchSettings) -> Array:
    """Return the candidate angles (m, 3) [deg] within the limits, without angles that a whole turn makes equal."""
    sides: list[Array] = []
    for low, high in zip(settings.minimum_deg, settings.maximum_deg, strict=True):
        first, last = np.ceil(low / settings.grid_deg), np.floor(high / settings.grid_deg)
        side = np.arange(first, last + 1) * settings.grid_deg
        keep = np.unique(np.round(np.mod(side, 360.0), 6), return_index=True)[1]
        sides.append(side[np.sort(keep)] if side.size else np.array([0.5 * (low + high)]))
    return np.stack([s.ravel() for s in np.meshgrid(*sides, indexing="ij")], axis=1)


def best_orientations(count: int, objective: Objective, table: TableUncertainty, settings: SearchSettings) -> Array:
    """Return the table angles (count, 3) [deg] of least cost: outer, middle, inner. Takes seconds."""
    with IMPORTING:
        from scipy.stats import qmc  # all of scipy's statistics for one sequence: only where it is used

    candidates = grid(settings)
    known = [information(candidates, d, objective.model, table) for d in objective.designs]
    begin = qmc.Halton(count, scramble=False).random(settings.starts + 1)[1:]
    found = [
        _exchanged((start * len(candidates)).astype(np.int64), known, objective, settings.sweeps) for start in begin
    ]
    chosen = min(found, key=lambda f: f[0])[1]
    return _descended(candidates[chosen], objective, table, settings)


def _exchanged(chosen: Indices, known: Sequence[Array], objective: Objective, sweeps: int) -> tuple[float, Indices]:
    """Cost and indices of a plan that no exchange of a single station betters."""
    start = prior(objective.model)
    chosen, cost = chosen.copy(), np.inf
    for _ in range(sweeps):
        before = cost
        for i in range(len(chosen)):
            others = [start + k[np.delete(chosen, i)].sum(axis=0) for k in known]
            costs = objective.cost([o + k for o, k in zip(others, known, strict=True)])
            chosen[i], cost = int(np.argmin(costs)), float(costs.min())
        if cost > before * (1.0 - 1e-4):
            break
    return cost, chosen


def _descended(angles_deg: Array, objective: Objective, table: TableUncertainty, settings: SearchSettings) -> Array:
    """The plan moved to the nearest hollow of the cost, within the limits."""
    n, start = len(angles_deg), prior(objective.model)
    steps = np.concatenate([np.eye(3), -np.eye(3)]) * _STEP_DEG

    def cost_and_gradient(x: Array) -> tuple[float, Array]:
        angles = x.reshape(n, 3)
        moved = (angles[:, None, :] + steps).reshape(-1, 3)
        totals, shifted = [], []
        for design in objective.designs:
            each = information(angles, design, objective.model, table)
            total = start + each.sum(axis=0)
            other = information(moved, design, objective.model, table).reshape(n, 6, *total.shape)
            totals.append(total)
            shifted.append(total - each[:, None] + other)
        costs = objective.cost(shifted)
        gradient = (costs[:, :3] - costs[:, 3:]) / (2.0 * _STEP_DEG)
        return float(objective.cost(totals)), gradient.ravel()

    bounds = list(zip(settings.minimum_deg, settings.maximum_deg, strict=True)) * n
    found = minimize(
        cost_and_gradient,
        angles_deg.ravel(),
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"maxiter": settings.iterations},
    )
    return np.asarray(found.x, dtype=np.float64).reshape(n, 3)
