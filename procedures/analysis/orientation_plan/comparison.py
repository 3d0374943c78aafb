"""Comparison of plans of orientations in the same bench time, by the estimators that would use them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from procedures.analysis.calibration.plan import TriadPlan, parts_by_noise, triad_plan
from procedures.analysis.calibration.reference import reference_magnitude, reference_vectors
from procedures.analysis.calibration.scalar import fit_scalar, scalar_parameters
from procedures.analysis.calibration.station_plan import move_time_s, windows
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.orientation_plan.information import Model, TriadDesign
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.recording import Station
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.unit import Unit


@dataclass(frozen=True)
class Requirements:
    """Limits that uncertainties are measured by, one triad's: bias [SI], scale factor and cross-coupling [relative]."""

    bias: float
    scale_factor: float
    cross_coupling: float

    def of_twelve(self, matrix: Array) -> Array:
        """Return the limits of the twelve coefficients in their units, shape (12,): a row of K in parts of its scale
        factor.
        """
        found = np.zeros((3, 4))
        for c in range(3):
            found[c] = self.bias, *(np.full(3, self.cross_coupling) * abs(matrix[c, c]))
            found[c, 1 + c] = self.scale_factor * abs(matrix[c, c])
        return found.ravel()

    def of_nine(self, matrix: Array) -> Array:
        """Return the limits of the scalar nine (b, s, t) in their units, shape (9,)."""
        scale = self.scale_factor / np.abs(np.diagonal(matrix))
        return np.array([self.bias] * 3 + scale.tolist() + [self.cross_coupling] * 3)


@dataclass(frozen=True)
class Setting:
    """The bench, the site, the unit and the model for which plans are compared."""

    unit: Unit
    site: Site
    table: TableUncertainty
    axes: tuple[tuple[float, float], ...]
    """(rate [deg/s], acceleration [deg/s²]) of outer, middle and inner."""
    settle_s: float
    model: Model
    requirements: Mapping[str, Requirements]
    """Requirements by triad; only these triads count."""

    def limits(self, triad: str, matrix: Array) -> Array:
        """Return the limits of the model's coefficients, shape (12,) or (9,)."""
        r = self.requirements[triad]
        return r.of_nine(matrix) if self.model == "scalar" else r.of_twelve(matrix)


@dataclass(frozen=True)
class ScoredPlan:
    """Orientations in order, the dwell that fills the time, and the standard uncertainties to expect."""

    angles: tuple[TableAngles, ...]
    dwell_s: float
    total_s: float
    sd: Mapping[str, Array]
    """Standard uncertainties by triad, of the twelve or the nine coefficients, SI."""
    relative: Mapping[str, Array]
    """Standard uncertainties divided by their limits."""

    def worst(self, triad: str) -> float:
        """Return the greatest ratio of standard uncertainty to limit of a triad."""
        return float(self.relative[triad].max())

    @property
    def worst_of_all(self) -> float:
        """Worst ratio over all triads, by which plans are compared."""
        return max(self.worst(triad) for triad in self.relative)


def stations(angles: Sequence[TableAngles], dwell_s: float, settle_s: float) -> tuple[Station, ...]:
    """Return the stations of the plan, one an orientation, in order."""
    return tuple(
        Station(i, f"{a.outer_deg:.4g} {a.middle_deg:.4g} {a.inner_deg:.4g}", a, settle_s=settle_s, record_s=dwell_s)
        for i, a in enumerate(angles)
    )


def total_time_s(angles: Sequence[TableAngles], dwell_s: float, setting: Setting) -> float:
    """Return the duration from the table's zero to the end of the last dwell [s]."""
    return float(windows(stations(angles, dwell_s, setting.settle_s), setting.axes)[-1, 1])


def in_short_order(angles: Sequence[TableAngles], setting: Setting) -> tuple[TableAngles, ...]:
    """Return the orientations ordered by the nearest next, beginning from the table's zero."""
    left, at, ordered = list(angles), TableAngles(), list[TableAngles]()
    while left:
        at = min(left, key=partial(move_time_s, at, axes=setting.axes))
        left.remove(at)
        ordered.append(at)
    return tuple(ordered)


def scored(angles: Sequence[TableAngles], total_s: float, setting: Setting) -> ScoredPlan:
    """Return the plan in this order, with the longest dwell that the time allows.

    Raises `Undetermined` where the orientations do not show all coefficients, `BadParameter` where the time is too
    short to move.
    """
    moving = total_time_s(angles, 1.0, setting) - len(angles)
    dwell = (total_s - moving) / len(angles)
    if dwell < 1.0:
        raise BadParameter("dwell_s", dwell, f"{len(angles)} stations leave no time to dwell, at least 1 s is needed")
    sd: dict[str, Array] = {}
    relative: dict[str, Array] = {}
    for triad in setting.requirements:
        table = TableUncertainty() if setting.model == "linear" else setting.table
        record = stations(angles, dwell, setting.settle_s)
        plan = triad_plan(triad, setting.unit, record, setting.axes, setting.site, table)
        sd[triad] = _scalar_sd(plan, setting) if setting.model == "scalar" else _linear_sd(plan)
        relative[triad] = sd[triad] / setting.limits(triad, plan.matrix)
    return ScoredPlan(tuple(angles), dwell, total_s, sd, relative)


def design(triad: str, count: int, dwell_s: float, setting: Setting) -> TriadDesign:
    """Return the design of a triad for a search of `count` orientations: a dwell's noise in shared and independent
    parts.
    """
    record = stations([TableAngles()] * count, dwell_s, setting.settle_s)
    plan = triad_plan(triad, setting.unit, record, setting.axes, setting.site, setting.table)
    covariance = _known_noise(plan)
    off = ~np.eye(count, dtype=bool)
    shared = np.maximum(np.array([c[off].mean() for c in covariance]), 0.0)
    own = np.array([np.diagonal(c).mean() for c in covariance]) - shared
    # The search sees the scalar model at K = 1; its limits of scale are relative then.
    matrix = np.eye(3) if setting.model == "scalar" else plan.matrix
    return TriadDesign(triad, plan.vectors[0], own, shared, setting.limits(triad, matrix), matrix)


def worst_bound(triad: str, count: int, total_s: float, setting: Setting) -> float:
    """Lower bound of the worst coefficient over its limit, for any plan of `count` stations in this time.

    For any values of the other unknowns, a channel's scale factor has ``var(K_cc) ≥ λ_c/Σ_i v²_ic``, λ_c the least
    eigenvalue of its covariance C_c of the means, and all channels together have ``Σ_c Σ_i v²_ic = n·|v|²``. Shared out
    so that no channel is worse off than another this makes the worst ``√(Σ_c λ_c/K²_cc/(n·|v|²))``; the scalar model's
    ``Σ_i u⁴_ic·v²`` only makes it larger. A bias has at least ``1/(1ᵀC_c⁻¹1)``, which no orientation changes. Moves
    count as no time at all.
    """
    dwell = (total_s - count * setting.settle_s) / count
    record = stations([TableAngles()] * count, dwell, setting.settle_s)
    plan = triad_plan(triad, setting.unit, record, setting.axes, setting.site, setting.table)
    covariance = _known_noise(plan)
    required = setting.requirements[triad]
    least = np.array([np.linalg.eigvalsh(c)[0] for c in covariance]) / np.diagonal(plan.matrix) ** 2
    scale = np.sqrt(least.sum() / count) / np.linalg.norm(plan.vectors[0])
    bias = max(float(np.sqrt(1.0 / np.linalg.solve(c, np.ones(count)).sum())) for c in covariance)
    return max(float(scale) / required.scale_factor, bias / required.bias)


def worst_by_triad(plan: ScoredPlan) -> dict[str, float]:
    """Return the greatest ratio of standard uncertainty to limit of each triad, for the search's objective."""
    return {triad: plan.worst(triad) for triad in plan.relative}


def _known_noise(plan: TriadPlan) -> Array:
    """Covariance of the station means, (3, n, n). Raises `BadParameter` where the unit's record has none."""
    covariance = plan.noise_covariance()
    if covariance is None:
        raise BadParameter("unit", plan.unit.serial, f"the noise of its {plan.triad} triad is not known")
    return covariance


def _linear_sd(plan: TriadPlan) -> Array:
    return np.hypot(*parts_by_noise(plan, _known_noise(plan)))


def _scalar_sd(plan: TriadPlan, setting: Setting) -> Array:
    """Standard uncertainties by `fit_scalar` at the noise-free outputs of the plan."""
    noise = _known_noise(plan)
    angles = [s.angles for s in plan.stations if s.angles is not None]
    vectors = reference_vectors(plan.triad, angles, setting.site)
    start = scalar_parameters(np.column_stack([np.zeros(3), plan.matrix]).ravel())
    reference = reference_magnitude(plan.triad, setting.site)
    outputs = vectors @ plan.matrix.T
    return fit_scalar(f"the nine of the {plan.triad}", outputs, noise, reference, start).standard_uncertainties
