"""Plan of better orientations: table angles of least uncertainty in the bench time of the thesis's twelve.

A search over what the table can do, for the linear model on an ideal table, for the one that estimates the table's
errors along, or for the scalar one; measured by the worst coefficient's predicted standard uncertainty over its limit,
with the estimators that the calibration itself uses. Give a recording or a calibration, which names the unit.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from procedures.analysis.calibration.station_plan import THESIS_ORIENTATIONS
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.orientation_plan import comparison
from procedures.analysis.orientation_plan.comparison import Requirements, ScoredPlan, Setting
from procedures.analysis.orientation_plan.information import Model, Objective
from procedures.analysis.orientation_plan.search import SearchSettings, best_orientations
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.frames import orientation_beta_gamma
from procedures.core.limits import Limit, check, verdict
from procedures.core.report import Report, Table
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.unit import Unit
from procedures.procedure import Evidence, Method, Outcome, Parameters

Angle = Annotated[float, Field(ge=-720.0, le=720.0)]
Arcsec = Annotated[float, Field(ge=0.0, le=3600.0)]
Triad = Literal["gyro", "accelerometer"]
SCALAR_MIN = 9
WORSE_MAX = 1.05
"""Greatest loss of a triad's worst uncertainty for which a plan is still recommended by its gain in another."""


class Params(Parameters):
    """Site, table and model of the calibration, and its limits. Latitude and gravity depend on the place."""

    latitude_deg: float = Field(ge=-90.0, le=90.0)
    gravity_m_s2: float = Field(ge=9.7, le=9.9)
    azimuth_deg: float = Field(0.0, ge=-360.0, le=360.0)
    model: Model = Field(
        "linear_with_table",
        description="linear: ideal table; linear_with_table: its errors are estimated along; scalar: magnitudes alone",
    )
    triads: tuple[Triad, ...] = Field(("gyro", "accelerometer"), min_length=1, max_length=2)
    reference: tuple[tuple[Angle, Angle], ...] = Field(
        THESIS_ORIENTATIONS, min_length=4, max_length=100, description="(β, γ) of the plan to beat"
    )
    dwell_s: float | None = Field(None, ge=1.0, le=86_400.0, description="of the reference; None: the averaging time")
    settle_s: float = Field(2.0, ge=0.0, le=3600.0)
    station_counts: tuple[Annotated[int, Field(ge=4, le=24)], ...] = Field(
        (6, 8, 9, 12), min_length=1, max_length=6, description="numbers of stations to try in the same time"
    )
    minimum_deg: tuple[Angle, Angle, Angle] = Field((-180.0, -180.0, -180.0), description="outer, middle, inner")
    maximum_deg: tuple[Angle, Angle, Angle] = (180.0, 180.0, 180.0)
    rate_deg_s: float = Field(60.0, gt=0.0, le=1e4, description="rate of every axis, for the time of the moves")
    acceleration_deg_s2: float = Field(100.0, gt=0.0, le=1e5)
    orthogonality_sd_arcsec: Arcsec = 3.0
    pointing_sd_arcsec: Arcsec = 1.0
    level_sd_arcsec: Arcsec = 1.0
    azimuth_sd_arcsec: Arcsec = 5.0
    gyro_bias_deg_h: float = Field(0.015, gt=0.0, le=1e6, description="limits (thesis 4.3, 5.6)")
    gyro_scale_ppm: float = Field(10.0, gt=0.0, le=1e6)
    accelerometer_bias_m_s2: float = Field(0.0005, gt=0.0, le=100.0)
    accelerometer_scale_ppm: float = Field(200.0, gt=0.0, le=1e6)
    cross_coupling_arcsec: float = Field(
        10.0, gt=0.0, le=36_000.0, description="largest cross-coupling of both triads (ours)"
    )
    grid_deg: float = Field(45.0, ge=15.0, le=90.0, description="grid of the first search")
    starts: int = Field(4, ge=1, le=16)
    improvement_min: float = Field(1.3, ge=1.0, le=100.0, description="that a better plan should reach")


@dataclass(frozen=True)
class TriadWorth:
    """Performance of one triad under one plan: worst uncertainty over limit, improvement, bound."""

    triad: str
    worst: float
    """Greatest standard uncertainty over its limit."""
    improvement: float
    """Ratio of the reference's worst to this."""
    bound: float
    """Lower bound of the worst for any plan of as many stations in this time."""
    standard_uncertainties: tuple[float, ...]
    """Standard uncertainties of the twelve (b, K_i1, K_i2, K_i3 by channel) or the scalar nine (b, s, t), SI."""


@dataclass(frozen=True)
class Plan:
    """Plan of orientations in order; (outer, middle, inner) in degrees."""

    name: str
    orientations_deg: tuple[tuple[float, float, float], ...]
    dwell_s: float
    improvement: float
    """Improvement of the worst coefficient over all triads."""
    triads: tuple[TriadWorth, ...]


class Result(Outcome):
    """The plan to beat first, then a plan for every number of stations, and which of them is recommended."""

    model: str
    total_s: float
    plans: tuple[Plan, ...]
    recommended: int
    """Index of the recommended plan in `plans`."""
    sentence: str


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Search, score and compare plans, and return them with the recommended one. Raises `BadParameter` without a unit
    of known noise, `Undetermined` for a reference that does not show all coefficients.
    """
    if unit is None:
        raise BadParameter("recordings", 0, "give a recording or a calibration of the unit to plan for")
    if any(low > high for low, high in zip(params.minimum_deg, params.maximum_deg, strict=True)):
        raise BadParameter("minimum_deg", params.minimum_deg, f"at most maximum_deg = {params.maximum_deg}")
    setting = _setting(params, unit)
    angles = [orientation_beta_gamma(beta, gamma) for beta, gamma in params.reference]
    dwell = params.dwell_s or unit.averaging_time_s
    total = comparison.total_time_s(angles, dwell, setting)
    reference = comparison.scored(angles, total, setting)
    counts = [n for n in sorted(set(params.station_counts)) if params.model != "scalar" or n >= SCALAR_MIN]
    if not counts:
        raise BadParameter("station_counts", params.station_counts, f"at least {SCALAR_MIN} for the scalar nine")
    found = [_searched(n, total, reference, setting, params) for n in counts]
    plans = (
        _told("reference", reference, reference, setting),
        *(_told(f"{len(p.angles)} stations", p, reference, setting) for p in found),
    )
    recommended = _recommended(plans)
    best = plans[recommended]
    limit = Limit("1", minimum=params.improvement_min, source=params.source_of("improvement_min"))
    checks = (check("worst uncertainty, reference over recommended", best.improvement, limit),)
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=_warnings(best),
        model=params.model,
        total_s=total,
        plans=plans,
        recommended=recommended,
        sentence=_sentence(best, plans[0], params),
    )


def report(result: Result) -> Report:
    """Return the report comparing the plans, then the recommended orientations."""
    rows = tuple(
        (p.name, len(p.orientations_deg), p.dwell_s, t.triad, t.worst, t.improvement, t.bound)
        for p in result.plans
        for t in p.triads
    )
    columns = ("plan", "stations", "dwell, s", "triad", "worst sd / limit", "improvement", "bound")
    note = f"All in {result.total_s:.0f} s of bench time. Bound: no orientations make the worst less."
    best = result.plans[result.recommended]
    stations = tuple((i + 1, *angles) for i, angles in enumerate(best.orientations_deg))
    return Report(
        result.sentence,
        (
            Table("Plans", columns, rows, note),
            Table(f"Orientations: {best.name}", ("station", "outer, deg", "middle, deg", "inner, deg"), stations),
        ),
    )


def _setting(params: Params, unit: Unit) -> Setting:
    cross = params.cross_coupling_arcsec * units.ARCSEC
    requirements = {
        "gyro": Requirements(params.gyro_bias_deg_h * units.DEG_PER_HOUR, params.gyro_scale_ppm * units.PPM, cross),
        "accelerometer": Requirements(
            params.accelerometer_bias_m_s2, params.accelerometer_scale_ppm * units.PPM, cross
        ),
    }
    table = TableUncertainty(
        params.orthogonality_sd_arcsec, params.pointing_sd_arcsec, params.level_sd_arcsec, params.azimuth_sd_arcsec
    )
    return Setting(
        unit,
        Site(params.latitude_deg, params.gravity_m_s2, params.azimuth_deg, params.azimuth_sd_arcsec),
        table,
        ((params.rate_deg_s, params.acceleration_deg_s2),) * 3,
        params.settle_s,
        params.model,
        {triad: requirements[triad] for triad in params.triads},
    )


def _searched(count: int, total_s: float, reference: ScoredPlan, setting: Setting, params: Params) -> ScoredPlan:
    dwell = total_s / count - setting.settle_s
    if dwell < 1.0:
        raise BadParameter("station_counts", count, f"{total_s:.4g} s leave no time to dwell")
    designs = [comparison.design(triad, count, dwell, setting) for triad in setting.requirements]
    objective = Objective(designs, setting.model, comparison.worst_by_triad(reference))
    settings = SearchSettings(params.minimum_deg, params.maximum_deg, params.grid_deg, params.starts)
    angles = np.round(best_orientations(count, objective, setting.table, settings), 2)
    ordered = comparison.in_short_order([TableAngles(*row) for row in angles.tolist()], setting)
    return comparison.scored(ordered, total_s, setting)


def _told(name: str, plan: ScoredPlan, reference: ScoredPlan, setting: Setting) -> Plan:
    triads = tuple(
        TriadWorth(
            triad,
            plan.worst(triad),
            reference.worst(triad) / plan.worst(triad),
            comparison.worst_bound(triad, len(plan.angles), plan.total_s, setting),
            tuple(plan.sd[triad].tolist()),
        )
        for triad in plan.relative
    )
    orientations = tuple((a.outer_deg, a.middle_deg, a.inner_deg) for a in plan.angles)
    return Plan(name, orientations, plan.dwell_s, reference.worst_of_all / plan.worst_of_all, triads)


def _recommended(plans: Sequence[Plan]) -> int:
    """The greatest improvement among plans that cost no triad more than `WORSE_MAX`; the reference if none improves."""
    fair = [i for i, p in enumerate(plans) if all(t.improvement * WORSE_MAX >= 1.0 for t in p.triads)]
    return max(fair, key=lambda i: plans[i].improvement)


def _sentence(best: Plan, reference: Plan, params: Params) -> str:
    if best is reference:
        return (
            "No plan was found that is surer than the reference in the same time; with as many stations no "
            f"orientations could be more than {_reach(reference, reference):.2f} times as sure."
        )
    n, m = len(best.orientations_deg), len(reference.orientations_deg)
    said = (
        f"{n} stations of {best.dwell_s:.0f} s make the worst coefficient {best.improvement:.2f} times surer than the "
        f"reference's {m} of {reference.dwell_s:.0f} s in the same bench time"
    )
    if best.improvement >= params.improvement_min:
        return said + "."
    return said + f"; with {n} stations no orientations could reach more than {_reach(best, reference):.2f}."


def _reach(plan: Plan, reference: Plan) -> float:
    """Upper bound of the improvement by a number of stations."""
    return max(t.worst for t in reference.triads) / max(t.bound for t in plan.triads)


def _warnings(best: Plan) -> tuple[str, ...]:
    return tuple(
        f"{t.triad}: the worst coefficient stays {t.worst:.3g} times its limit; no {len(best.orientations_deg)} "
        f"stations in this time get below {t.bound:.3g}"
        for t in best.triads
        if t.worst > 1.0
    )


METHOD = Method("plan_orientations", "Better orientations", "1.0.0", Params, Result, analyse, report)
