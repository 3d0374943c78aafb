"""Information of one station about a triad's coefficients: matrices that add up over stations.

Station means are taken as independent (the slow noise that they share goes into the bias alone, for all
orientations); flaws of the table that last are further unknowns, with their declared spreads, and
the pointing of a station is a part of its noise. So the information of a plan is the sum over its stations and the
prior, and a search may exchange one station for another by a subtraction and an addition. The final comparison of
plans uses the estimators themselves (`comparison`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.core import units
from procedures.core.arrays import Array

Model = Literal["linear", "linear_with_table", "scalar"]
FLAWS = 6
"""Lasting flaws of a table: two right angles, two levels, azimuth, gravity."""


@dataclass(frozen=True)
class TriadDesign:
    """One triad as the search sees it: reference vector, noise of a dwell, limits of its coefficients, matrix."""

    triad: str
    vector_r: Array
    """Specific force or Earth's rate at zero table angles, shape (3,) [SI]."""
    noise_variance: Array
    """Independent variance of a station mean, per channel, shape (3,) [SI²]."""
    slow_variance: Array
    """Variance shared by all stations, shape (3,) [SI²]: it goes into the bias."""
    limits: Array
    """Limits of the twelve coefficients, channel by channel, shape (12,), or of the scalar nine, (9,)."""
    matrix: Array
    """Best known K of the triad, shape (3, 3)."""


def unit_vectors(angles_deg: Array, vector_r: Array) -> Array:
    """Return a constant vector in the unit's axes at table angles (m, 3), outer, middle, inner; shape (m, 3)."""
    return np.asarray(Rotation.from_euler("YZX", angles_deg, degrees=True).inv().apply(vector_r), dtype=np.float64)


def flaw_axes(angles_deg: Array) -> Array:
    """Return the axes of the table's eight turns in the unit's axes, shape (m, 8, 3), in the order of
    `table_errors`.
    """
    whole = Rotation.from_euler("YZX", angles_deg, degrees=True).inv()
    inner = Rotation.from_euler("X", angles_deg[:, 2:], degrees=True).inv()
    middle = Rotation.from_euler("Z", angles_deg[:, 1:2], degrees=True).inv()
    x, y, z = np.eye(3)
    turned = [(inner * middle).apply(x), inner.apply(y), whole.apply(x), whole.apply(z), whole.apply(y)]
    pointing = [whole.apply(y), inner.apply(z), np.broadcast_to(x, (len(angles_deg), 3))]
    return np.stack([*turned, *pointing], axis=1)


def information(angles_deg: Array, design: TriadDesign, model: Model, table: TableUncertainty) -> Array:
    """Information of each of m stations about the coefficients in their limits: (m, 18, 18) linear, (m, 9, 9) scalar.

    The linear eighteen are the twelve coefficients, each divided by its limit, and the six flaws, each by its spread.
    """
    vectors = unit_vectors(angles_deg, design.vector_r)
    if model == "scalar":
        return _scalar(vectors, design)
    m = len(vectors)
    rows = np.zeros((m, 3, 12 + FLAWS))
    ones = np.column_stack([np.ones(m), vectors])
    for c in range(3):
        rows[:, c, 4 * c : 4 * c + 4] = ones * design.limits[4 * c : 4 * c + 4]
    noise = np.broadcast_to(np.diag(design.noise_variance), (m, 3, 3))
    if model == "linear_with_table":
        seen = np.cross(vectors[:, None, :], flaw_axes(angles_deg)) @ design.matrix.T
        of_gravity = vectors @ design.matrix.T * (table.gravity_relative_sd if design.triad == "accelerometer" else 0.0)
        t = table
        sd = [t.orthogonality_sd_arcsec] * 2 + [t.level_sd_arcsec] * 2 + [t.azimuth_sd_arcsec]
        rows[:, :, 12:17] = (seen[:, :5] * (np.array(sd) * units.ARCSEC)[:, None]).transpose(0, 2, 1)
        rows[:, :, 17] = of_gravity
        pointing = seen[:, 5:] * (t.pointing_sd_arcsec * units.ARCSEC)
        noise = noise + pointing.transpose(0, 2, 1) @ pointing
    return rows.transpose(0, 2, 1) @ np.linalg.solve(noise, rows)


def _scalar(vectors: Array, design: TriadDesign) -> Array:
    """Derivatives of ``|v̂|`` at K = 1: ``∂/∂b = −u``, ``∂/∂s_i = u_i·v_i``, ``∂/∂t_ij = u_i·v_j`` (thesis 3.21)."""
    u = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    of_angles = [u[:, i] * vectors[:, j] for i, j in ((0, 1), (0, 2), (1, 2))]
    rows = np.column_stack([-u, u * vectors, *of_angles]) * design.limits
    variance = u**2 @ design.noise_variance
    return rows[:, :, None] * (rows / variance[:, None])[:, None, :]


def prior(model: Model) -> Array:
    """Return the prior information before the first station: the flaws, to one spread each. The rest is next to
    nothing.
    """
    size, known = (9, 0) if model == "scalar" else (12 + FLAWS, FLAWS)
    # A coefficient is known beforehand to 30 000 times its limit: keeps unlucky beginnings of a search finite.
    return np.diag([1e-9] * (size - known) + [1.0] * known)


def relative_sd(total: Array, design: TriadDesign, model: Model) -> Array:
    """Return standard uncertainties over limits from total information (…, P, P): (…, 12) linear, (…, 9) scalar."""
    variance = np.diagonal(np.linalg.inv(total), axis1=-2, axis2=-1).copy()
    biases = np.array([0, 1, 2] if model == "scalar" else [0, 4, 8])
    variance[..., biases] += design.slow_variance / design.limits[biases] ** 2
    return np.sqrt(np.maximum(variance[..., : 9 if model == "scalar" else 12], 0.0))


@dataclass(frozen=True)
class Objective:
    """Objective of the search: the worst coefficient relative to its limit, over all triads.

    Smooth: ``(Σ r^p)^(1/p)`` over r = sd/limit, divided by `reference`. A triad far inside its limits must not be given
    up for another one: its own worst, over what it was in the reference plan, counts with `care`.
    """

    designs: Sequence[TriadDesign]
    model: Model
    reference: Mapping[str, float]
    """Worst sd/limit of each triad in the plan to beat."""
    power: float = 12.0
    care: float = 0.7

    def cost(self, totals: Sequence[Array]) -> Array:
        """Return the cost of total informations, one (…, P, P) a triad; shape (…)."""
        worst = max(self.reference.values())
        parts: list[Array] = []
        for total, design in zip(totals, self.designs, strict=True):
            r = relative_sd(total, design, self.model)
            parts += [r / worst, self.care * r / self.reference[design.triad]]
        return np.sum(np.concatenate(parts, axis=-1) ** self.power, axis=-1) ** (1.0 / self.power)
