"""Free-inertial run over a recording at rest: the drift that a calibration leaves, beside its prediction.

The unit aligns itself on the first part of the recording and navigates the rest from cell means that are corrected by
its calibration (`analysis.navigation.free_inertial`). It did not move, so where it ends is its error. `error_growth`
predicts the covariance of that error from the calibration, the change from launch to launch and the noise, and the
Mahalanobis distance ``d² = eᵀP⁻¹e`` of the last position judges it: chi-square of two degrees of freedom.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import Field

from procedures.analysis.cells import Cells, cell_means
from procedures.analysis.fitness.findings import FitnessSettings
from procedures.analysis.fitness.watched import Inspection
from procedures.analysis.least_squares.chi_square import chi_square, tail_probability
from procedures.analysis.navigation import growth_summary as told
from procedures.analysis.navigation.alignment import initial_attitude, rotation_nb
from procedures.analysis.navigation.error_growth import Alignment, Growth, error_growth
from procedures.analysis.navigation.error_model import Place
from procedures.analysis.navigation.free_inertial import Track, free_inertial
from procedures.analysis.navigation.instrument_errors import LAUNCH, TriadErrors, calibrated_triad
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, Undetermined, UnfitRecording
from procedures.core.imu_model import TriadCalibration, correct
from procedures.core.limits import ASKED, Check, Limit, check, verdict
from procedures.core.recording import ACCELEROMETER, GYRO, TRIADS, Recording
from procedures.core.report import Figure, Report, Series, Table
from procedures.core.unit import Unit
from procedures.parameters import level_check, planned_tests
from procedures.procedure import Evidence, Method, Outcome, RecordedParameters

NAMES = ("gyro", "accelerometer")
LEAST_CELLS = 60
"""Cells that must remain for the navigation."""


class Params(RecordedParameters):
    """Site of the recording, its parts, and limits; neither latitude nor gravity has a default."""

    latitude_deg: float = Field(ge=-90.0, le=90.0)
    gravity_m_s2: float = Field(ge=9.7, le=9.9)
    earth_rate_rad_s: float = Field(units.EARTH_RATE, ge=7.0e-5, le=7.6e-5)
    alignment_s: float = Field(600.0, ge=1.0, le=86_400.0, description="first part of the recording, for the alignment")
    cell_s: float = Field(2.0, ge=0.01, le=60.0, description="means that are navigated with")
    p_value_min: float = Field(
        0.001, ge=0.0, le=1.0, description="smallest p-value accepted for the last position's Mahalanobis distance"
    )
    drift_max_m: float | None = Field(None, gt=0.0, le=1e7, description="limit of the greatest distance from the start")


@dataclass(frozen=True)
class Attitude:
    """Attitude of the alignment [deg], heading clockwise from north."""

    heading_deg: float
    pitch_deg: float
    roll_deg: float


class Result(Outcome):
    """Drift of the navigator beside its prediction."""

    basis: str
    sentence: str
    attitude: Attitude
    alignment_s: float
    time_s: tuple[float, ...]
    """Times since the alignment's end at which all curves are given."""
    north_m: tuple[float, ...]
    east_m: tuple[float, ...]
    radial_m: tuple[float, ...]
    velocity_north_m_s: tuple[float, ...]
    velocity_east_m_s: tuple[float, ...]
    radius_95_m: tuple[float, ...]
    """Predicted radius of the circle about the start that holds the position with 95 %, at `time_s`."""
    mahalanobis: float
    """Distance of the last position in standard deviations of the prediction, ``√(eᵀP⁻¹e)``."""
    p_value: float
    """Chance of a distance at least as large; a lower figure where the noise is not known."""
    noise_known: bool


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Align, navigate and judge one recording, with the calibrations given, else the unit's current ones; return the
    drift.

    Raises `BadParameter` for a part that the recording does not have, `UnfitRecording` where it is not at rest.
    """
    if len(evidence.recordings) != 1:
        raise BadParameter("recordings", len(evidence.recordings), "one recording of a unit at rest")
    place = Place(params.latitude_deg * units.DEG, params.gravity_m_s2, params.earth_rate_rad_s)
    calibrations, basis = evidence.calibrations_of(unit, NAMES)
    cells = cell_means(evidence.recordings[0], GYRO + ACCELEROMETER, params.cell_s)
    rate, force = _corrected(evidence.recordings[0], cells, calibrations)
    first = _aligning_cells(params, cells)
    angles = _aligned(force[:first], rate[:first], params)
    attitude = rotation_nb(*angles)
    track = free_inertial(place, attitude, rate[first:], force[first:], cells.cell_s)
    gyro, accelerometer = (
        calibrated_triad(calibrations[name], unit.triad(name) if unit else None, vectors[:first].mean(axis=0))
        for name, vectors in (("gyro", rate), ("accelerometer", force))
    )
    alignment = Alignment(first * cells.cell_s, warm_up_s=cells.since_launch_s)
    growth = error_growth(place, attitude, gyro, accelerometer, alignment, float(track.time_s[-1]))
    return _result(params, basis, place, angles, track, growth, (gyro, accelerometer), alignment)


def _corrected(recording: Recording, cells: Cells, calibrations: dict[str, TriadCalibration]) -> tuple[Array, Array]:
    """Corrected rates and forces of the cells, each (n, 3). Raises `UnfitRecording` for another unit of outputs."""
    for name in NAMES:
        wanted = calibrations[name].output_unit
        found = {recording.info.channels[recording.info.column(c)].rate_unit for c in TRIADS[name]}
        if found != {wanted}:
            raise UnfitRecording(
                f"the {name} channels are in {', '.join(sorted(found))}, the calibration is for {wanted}"
            )
    return correct(cells.rates[:3].T, calibrations["gyro"]), correct(cells.rates[3:].T, calibrations["accelerometer"])


def _aligning_cells(params: Params, cells: Cells) -> int:
    count = cells.rates.shape[1]
    first = max(1, round(params.alignment_s / cells.cell_s))
    if count - first < LEAST_CELLS:
        longest = (count - LEAST_CELLS) * cells.cell_s
        allowed = (
            f"at most {longest:g} s, to leave {LEAST_CELLS} cells of {cells.cell_s:g} s to navigate with"
            if longest > 0.0
            else f"{count * cells.cell_s:g} s of recording are too short to navigate with cells of {cells.cell_s:g} s"
        )
        raise BadParameter("alignment_s", params.alignment_s, allowed)
    return first


def _aligned(force: Array, rate: Array, params: Params) -> Array:
    """Heading, pitch and roll (3,) [rad] of the means. Raises `UnfitRecording` for a unit on end."""
    site = (params.latitude_deg, params.gravity_m_s2, params.earth_rate_rad_s)
    try:
        return initial_attitude(force.mean(axis=0), rate.mean(axis=0), np.eye(6), *site).angles_rad
    except Undetermined as refusal:
        raise UnfitRecording(f"the recording cannot be aligned: {refusal}") from refusal


def _result(
    params: Params,
    basis: str,
    place: Place,
    angles: Array,
    track: Track,
    growth: Growth,
    errors: tuple[TriadErrors, TriadErrors],
    alignment: Alignment,
) -> Result:
    covariance = place.metres @ growth.total[-1] @ place.metres.T
    statistic = chi_square(np.array([track.north_m[-1], track.east_m[-1]]), covariance)
    p_value, known = tail_probability(statistic, 2), all(e.noise for e in errors)
    at: dict[str, Any] = {name: _at(growth.time_s, track, getattr(track, name)) for name in CURVES}
    radius = tuple(told.radius_95(place, p) for p in growth.total)
    heading, pitch, roll = (angles / units.DEG).tolist()
    checks = _checks(params, track, p_value if known else None, float(np.sqrt(statistic)))
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=_warnings(errors, known, params),
        basis=basis,
        sentence=_sentence(track, radius[-1], float(np.sqrt(statistic)), p_value, known),
        attitude=Attitude(heading % 360.0, pitch, roll),
        alignment_s=alignment.duration_s or 0.0,
        time_s=tuple(growth.time_s.tolist()),
        radius_95_m=radius,
        mahalanobis=float(np.sqrt(statistic)),
        p_value=p_value,
        noise_known=known,
        **at,
    )


CURVES = ("north_m", "east_m", "radial_m", "velocity_north_m_s", "velocity_east_m_s")


def _at(time_s: Array, track: Track, values: Array) -> tuple[float, ...]:
    return tuple(np.interp(time_s, track.time_s, values).tolist())


DRIFT = "drift as predicted, p-value of its Mahalanobis distance"


def _checks(params: Params, track: Track, p_value: float | None, distance: float) -> tuple[Check, ...]:
    made: list[Check] = []
    if p_value is not None:
        made.append(level_check(params, "p_value_min", DRIFT, p_value, f"{distance:.3g} standard deviations"))
    if params.drift_max_m is not None:
        limit = Limit("m", maximum=params.drift_max_m, source=ASKED)
        made.append(check("greatest distance from the start", float(track.radial_m.max()), limit))
    return tuple(made)


def _warnings(errors: tuple[TriadErrors, TriadErrors], known: bool, params: Params) -> tuple[str, ...]:
    found = told.warnings(*errors, all(LAUNCH in e.constant for e in errors))
    if known:
        return found
    way_out = "" if params.drift_max_m is not None else "; give `drift_max_m` to judge the drift itself"
    return (*found, f"the drift is not judged by its prediction, which lacks the noise{way_out}")


def _sentence(track: Track, radius_m: float, distance: float, p_value: float, known: bool) -> str:
    hours = float(track.time_s[-1]) / units.HOUR
    said = f"After {hours:.3g} h at rest the navigator is {track.radial_m[-1]:.3g} m from its start"
    judged = f", at {distance:.2g} standard deviations (p = {p_value:.2g})" if known else ""
    return f"{said}; predicted are {radius_m:.3g} m with 95 %{judged}."


def report(result: Result) -> Report:
    """Return the report: drift with the predicted radius, the track, and the velocities."""
    hours = tuple(t / units.HOUR for t in result.time_s)
    a = result.attitude
    rows = (
        ("heading, deg", a.heading_deg),
        ("pitch, deg", a.pitch_deg),
        ("roll, deg", a.roll_deg),
        ("alignment, s", result.alignment_s),
        ("distance from the start, m", result.radial_m[-1]),
        ("predicted radius of 95 %, m", result.radius_95_m[-1]),
        ("Mahalanobis distance", result.mahalanobis),
        ("p-value", result.p_value),
    )
    drift = (
        Series("distance from the start", hours, result.radial_m, style="line"),
        Series("predicted, 95 %", hours, result.radius_95_m, style="reference"),
    )
    velocity = (
        Series("north", hours, result.velocity_north_m_s, style="line"),
        Series("east", hours, result.velocity_east_m_s, style="line"),
    )
    track = (Series("track", result.east_m, result.north_m, style="line"),)
    sections = (
        Table("Free-inertial run at rest", ("quantity", "value"), rows, result.basis),
        Figure("Drift beside its prediction", "time, h", "m", drift),
        Figure("Track of the navigator", "east, m", "north, m", track),
        Figure("Velocity of the navigator", "time, h", "m/s", velocity),
    )
    return Report(result.sentence, sections)


METHOD = Method(
    "free_inertial",
    "Free-inertial run over a recording at rest",
    "1.0.0",
    Params,
    Result,
    analyse,
    report,
    planned_checks=lambda params, _unit, _planned: planned_tests(params, "p_value_min", DRIFT),
    inspection=lambda _params, _count: Inspection(FitnessSettings(least_samples=1), GYRO + ACCELEROMETER),
)
