"""Heading, pitch and roll of a unit that rested, from its corrected mean outputs (textbook S 3.163-3.166, thesis 1.1).

Each recording is an alignment of its own. The uncertainty has the calibration's covariance, the change from launch to
launch and the noise of the recording; the azimuth error of thesis 1.1, from the unit's noise, is given as well.
"""

from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field
from scipy.linalg import block_diag

from procedures.analysis.calibration.station_means import StationMeans, require_unit_of, station_means
from procedures.analysis.calibration.station_noise import outputs_covariance
from procedures.analysis.navigation.alignment import (
    InitialAttitude,
    initial_attitude,
    require_alignable,
    thesis_prediction,
)
from procedures.analysis.navigation.instrument_errors import calibrated_triad
from procedures.analysis.navigation.knock import AttitudeStep, attitude_step, step_degrees
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import Undetermined, UnfitRecording
from procedures.core.imu_model import TriadCalibration, correct
from procedures.core.limits import Check, Limit, check, verdict
from procedures.core.recording import ACCELEROMETER, GYRO, RecordingInfo
from procedures.core.report import Report, Table
from procedures.core.site import Site
from procedures.core.unit import Unit
from procedures.parameters import largest
from procedures.procedure import STATIONS, Evidence, Method, Outcome, RecordedParameters

TRIADS = ("accelerometer", "gyro")
LIKELY = 4.0
"""Standard deviations within which a magnitude must agree with the site's; beyond them the unit moved, or the site,
the calibration or the uncertainty is wrong: one in 16 000 by chance."""


class Params(RecordedParameters):
    """Site of the recordings; neither latitude nor gravity has a default, they depend on the place."""

    latitude_deg: float = Field(ge=-90.0, le=90.0)
    gravity_m_s2: float = Field(ge=9.7, le=9.9)
    gravity_sd_m_s2: float = Field(1e-4, ge=0.0, le=0.01)
    earth_rate_rad_s: float = Field(units.EARTH_RATE, ge=7.0e-5, le=7.6e-5)
    base_turn_arcsec: float = Field(0.0, ge=0.0, le=3600.0, description="turn of the base about east meanwhile")
    heading_sd_max_deg: float = Field(0.1, gt=0.0, le=180.0, description="limit of the heading's uncertainty (ours)")
    step_max_deg: float = Field(
        0.005, gt=0.0, le=180.0, description="limit of a step of the attitude meanwhile, a knock (ours)"
    )


@dataclass(frozen=True)
class AlignedAttitude:
    """Attitude from one recording [deg]; heading clockwise from north, 0 … 360."""

    recording: str
    heading_deg: float
    pitch_deg: float
    roll_deg: float
    heading_sd_deg: float
    pitch_sd_deg: float
    roll_sd_deg: float
    duration_s: float
    predicted_azimuth_error_deg: float | None
    """Predicted azimuth error, its parts added by magnitude (thesis 1.1); None where the unit's noise is not known."""
    predicted_azimuth_sd_deg: float | None
    """Predicted azimuth error with the parts as independent standard uncertainties."""
    magnitude_errors: tuple[float, float, float]
    """|f| − g [m/s²], |ω| − Ω and ω upwards − Ω·sin L [rad/s]."""
    magnitude_sd: tuple[float, float, float]
    """Standard uncertainties of `magnitude_errors`, in the same order and units."""
    step_deg: float | None = None
    """Step of the attitude within the recording; zero: none was seen; None: too few samples to look."""
    step_at_s: float | None = None
    """Time of the step since the recording's beginning; None: none was seen."""
    step_by: str = ""
    """Sensors that saw the step: "accelerometers" or "gyros"."""
    step_visible_deg: float | None = None
    """Smallest tilt within the recording that would have been seen."""


class Result(Outcome):
    """Every recording's attitude, in order."""

    basis: str
    attitudes: tuple[AlignedAttitude, ...]


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the attitude of each recording from its means, corrected with the calibration given, else the unit's
    current one. Raises `BadParameter` at a pole, `UnfitRecording`.
    """
    require_alignable(params.latitude_deg)
    if not evidence.recordings:
        raise UnfitRecording("there is no recording of a resting unit to align")
    calibrations, basis = evidence.calibrations_of(unit, TRIADS)
    means = {triad: station_means(evidence.recordings, triad) for triad in TRIADS}
    found = [_aligned(i, r.info, means, calibrations, params, unit) for i, r in enumerate(evidence.recordings)]
    steps = [attitude_step(r, calibrations) for r in evidence.recordings]
    attitudes = tuple(_with_step(_told(i, means, params, unit, a), steps[i]) for i, a in enumerate(found))
    checks = tuple(c for a in attitudes for c in _checks(a, params))
    known = unit is not None and all(unit.triad(triad) is not None for triad in TRIADS)
    missing = (
        () if known else ("noise and change from launch to launch are not known: uncertainties are lower figures",)
    )
    warnings = (*missing, *(w for a in attitudes for w in _step_warnings(a, params)))
    return Result(checks=checks, verdict=verdict(checks), warnings=warnings, basis=basis, attitudes=attitudes)


def report(result: Result) -> Report:
    """Return the report with a row a recording."""
    columns = ("recording", "heading, deg", "±", "pitch, deg", "±", "roll, deg", "±", "time, s", "thesis 1.1, deg")
    rows = tuple(
        (
            *(a.recording, a.heading_deg, a.heading_sd_deg, a.pitch_deg, a.pitch_sd_deg, a.roll_deg, a.roll_sd_deg),
            *(a.duration_s, a.predicted_azimuth_error_deg),
        )
        for a in result.attitudes
    )
    return Report(result.basis, (Table("Initial alignment", columns, rows, "± one standard uncertainty."),))


def _aligned(
    i: int,
    info: RecordingInfo,
    means: dict[str, StationMeans],
    calibrations: dict[str, TriadCalibration],
    params: Params,
    unit: Unit | None,
) -> InitialAttitude:
    window = np.array([[info.since_launch_s, info.since_launch_s + info.duration_s]])
    vectors: list[Array] = []
    covariances: list[Array] = []
    for triad in TRIADS:
        calibration, mean = calibrations[triad], means[triad]
        require_unit_of(calibration, mean)
        record = unit.triad(triad) if unit else None
        vector = correct(mean.outputs[i], calibration)
        errors = calibrated_triad(calibration, record, vector)
        known = outputs_covariance(record, mean.output_unit, window)
        variance = mean.mean_sd[i] ** 2 if known is None else known[:, 0, 0]
        inverse = np.linalg.inv(calibration.matrix_array)
        vectors.append(vector)
        covariances.append(np.sum(list(errors.constant.values()), axis=0) + inverse @ np.diag(variance) @ inverse.T)
    covariance = np.asarray(block_diag(*covariances), dtype=np.float64)
    site = (params.latitude_deg, params.gravity_m_s2, params.earth_rate_rad_s)
    try:
        return initial_attitude(vectors[0], vectors[1], covariance, *site)
    except Undetermined as refusal:
        raise UnfitRecording(f"recording {means['gyro'].labels[i]}: {refusal}") from refusal


def _told(
    i: int, means: dict[str, StationMeans], params: Params, unit: Unit | None, attitude: InitialAttitude
) -> AlignedAttitude:
    window = means["gyro"].windows[i]
    duration = float(window[1] - window[0])
    site = Site(params.latitude_deg, params.gravity_m_s2, earth_rate_rad_s=params.earth_rate_rad_s)
    predicted = None if unit is None else thesis_prediction(unit, site, params.base_turn_arcsec, duration)
    heading, pitch, roll = (attitude.angles_rad / units.DEG).tolist()
    sds = (np.sqrt(np.diagonal(attitude.covariance)) / units.DEG).tolist()
    gravity, rate, upward = attitude.magnitude_errors.tolist()
    gravity_sd, rate_sd, upward_sd = attitude.magnitude_sd.tolist()
    return AlignedAttitude(
        means["gyro"].labels[i],
        heading % 360.0,
        pitch,
        roll,
        sds[0],
        sds[1],
        sds[2],
        duration,
        None if predicted is None else predicted.added_deg,
        None if predicted is None else predicted.independent_deg,
        (gravity, rate, upward),
        (float(np.hypot(gravity_sd, params.gravity_sd_m_s2)), rate_sd, upward_sd),
    )


def _with_step(a: AlignedAttitude, step: AttitudeStep | None) -> AlignedAttitude:
    if step is None:
        return a
    visible = step.visible_rad / units.DEG
    if not step.seen:
        return replace(a, step_deg=0.0, step_visible_deg=visible)
    return replace(
        a, step_deg=step_degrees(step), step_at_s=step.time_s, step_by=step.shown_by, step_visible_deg=visible
    )


def _step_warnings(a: AlignedAttitude, params: Params) -> tuple[str, ...]:
    if a.step_deg is None or a.step_visible_deg is None:
        return (f"{a.recording}: too few samples to see whether the unit was moved meanwhile",)
    if a.step_at_s is None:
        hidden = f"{a.recording}: a knock that tilts by less than {a.step_visible_deg:.2g}° would not have been seen"
        return (hidden,) if a.step_visible_deg > params.step_max_deg else ()
    return (
        f"{a.recording}: the unit turned by about {a.step_deg:.2g}° at {a.step_at_s:.4g} s, by its {a.step_by}: it was "
        "knocked, and the attitude is a mean of two; repeat, or cut the recording there",
    )


def _checks(a: AlignedAttitude, params: Params) -> tuple[Check, ...]:
    limit = largest(params, "heading_sd_max_deg", "deg")
    found = [check(f"{a.recording}: heading, standard uncertainty", a.heading_sd_deg, limit)]
    kinds = (("|f| − g", "m/s^2"), ("|ω| − Ω", "rad/s"), ("ω upwards − Ω·sin L", "rad/s"))
    for (name, unit), error, sd in zip(kinds, a.magnitude_errors, a.magnitude_sd, strict=True):
        bound = Limit(unit, LIKELY * sd, -LIKELY * sd, source=f"{LIKELY:g} standard uncertainties")
        found.append(check(f"{a.recording}: {name}", error, bound, sd))
    if a.step_deg is not None:
        note = "" if a.step_at_s is None else f"at {a.step_at_s:.4g} s, by the {a.step_by}"
        limit = largest(params, "step_max_deg", "deg")
        found.append(check(f"{a.recording}: step of the attitude meanwhile", a.step_deg, limit, note=note))
    return tuple(found)


METHOD = Method(
    "initial_alignment_of_recording",
    "Initial alignment from a recording at rest",
    "1.1.0",
    Params,
    Result,
    analyse,
    report,
    inspection=lambda _params, _count: replace(STATIONS, channels=GYRO + ACCELEROMETER),
)
