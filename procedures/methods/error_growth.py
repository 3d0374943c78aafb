"""Position error due to a calibration: growth of a parked navigator's errors (textbook S 4, equations 4.119).

The residual errors of a unit after calibration, with the noise and the launch-to-launch change of its record, or errors
that are merely declared, carried through the linear error equations of a navigator that does not move.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from procedures.analysis.calibration.reference import TRIAD_NAMES
from procedures.analysis.navigation import growth_summary as told
from procedures.analysis.navigation.alignment import rotation_nb
from procedures.analysis.navigation.error_growth import Alignment, constant_error, error_growth
from procedures.analysis.navigation.error_model import HEADING, TILT_EAST, TILT_NORTH, Place
from procedures.analysis.navigation.growth_summary import Curve, radius_95
from procedures.analysis.navigation.instrument_errors import LAUNCH, TriadErrors, calibrated_triad, declared_triad
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Limit, check, verdict
from procedures.core.noise import NoiseCoefficients
from procedures.core.report import Report, Table
from procedures.core.unit import Unit
from procedures.procedure import Evidence, JudgedParameters, Method, Outcome, Parameters
from procedures.reports import growth

TILT_MAX_RAD = 0.01
HEADING_MAX_RAD = 0.1
"""Beyond these the equations are no longer linear to about one part in a hundred and in ten."""


class Declared(Parameters):
    """Declared errors of a unit without a calibration: standard uncertainties, alike on all axes."""

    gyro_bias_deg_h: float = Field(0.01, ge=0.0, le=1e4)
    gyro_scale_ppm: float = Field(10.0, ge=0.0, le=1e5)
    gyro_misalignment_arcsec: float = Field(10.0, ge=0.0, le=3600.0)
    gyro_random_walk_deg_sqrt_h: float = Field(0.003, ge=0.0, le=1e3)
    gyro_bias_instability_deg_h: float = Field(0.003, ge=0.0, le=1e4)
    accelerometer_bias_ug: float = Field(50.0, ge=0.0, le=1e6)
    accelerometer_scale_ppm: float = Field(100.0, ge=0.0, le=1e5)
    accelerometer_misalignment_arcsec: float = Field(10.0, ge=0.0, le=3600.0)
    accelerometer_random_walk_ug_sqrt_s: float = Field(0.0, ge=0.0, le=1e6, description="velocity random walk, µg·√s")
    accelerometer_bias_instability_ug: float = Field(1.0, ge=0.0, le=1e6)


class Params(JudgedParameters):
    """Position, attitude and initial errors of the navigator. The latitude has no default: it depends on the place."""

    latitude_deg: float = Field(ge=-90.0, le=90.0)
    gravity_m_s2: float = Field(units.STANDARD_GRAVITY, ge=9.7, le=9.9)
    hours: float = Field(3.0, gt=0.0, le=24.0)
    heading_deg: float = Field(0.0, ge=-360.0, le=360.0, description="of the parked unit, clockwise from north")
    pitch_deg: float = Field(0.0, ge=-90.0, le=90.0)
    roll_deg: float = Field(0.0, ge=-180.0, le=180.0)
    alignment: Literal["self", "given"] = Field(
        "self",
        description="self: by its own sensors where it stands; given: from outside, with the uncertainties below",
    )
    alignment_s: float = Field(600.0, ge=1.0, le=86_400.0, description="duration of the self-alignment")
    warm_up_s: float = Field(0.0, ge=0.0, le=86_400.0, description="since launch, before the alignment begins")
    tilt_sd_arcsec: float = Field(
        10.0, ge=0.0, le=36_000.0, description="standard uncertainty of the tilt of a given attitude"
    )
    heading_sd_arcsec: float = Field(
        60.0, ge=0.0, le=360_000.0, description="standard uncertainty of the heading of a given attitude"
    )
    vertical: Literal["held", "free"] = Field("held", description="held: height from an altimeter")
    declared: Declared | None = Field(None, description="in place of a calibration")
    position_1h_max_m: float | None = Field(None, gt=0.0, le=1e7, description="limit of the radius that holds 95 %")


@dataclass(frozen=True)
class Share:
    """Contribution of one source alone: radii that hold the position with 95 %, in m."""

    source: str
    after_1h_m: float
    at_end_m: float


class Result(Outcome):
    """Growth of position, velocity and attitude errors, and the contributions to it."""

    basis: str
    """Basis of the errors: a calibration, or declared values."""
    sentence: str
    schuler_period_s: float
    time_s: tuple[float, ...]
    curves: tuple[Curve, ...]
    radius_95_m: tuple[float, ...]
    """Radius of the circle about the true place that holds the navigator's with 95 %, at `time_s`."""
    shares: tuple[Share, ...]
    """Contribution of each source to the position error, the greatest first; after one hour even if `hours` is less."""
    radius_95_1h_m: float
    calibration_radius_95_1h_m: float | None
    """Radius after one hour by the calibration's uncertainty alone, without launch and noise; None: no calibration."""
    uncalibrated_1h_m: float | None
    """Position error of nominal outputs after one hour; None: no calibration, or too large for the equations."""


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the errors' growth for the one calibration given, else the unit's current one, else the declared errors.
    Raises `BadParameter`.
    """
    place = Place(params.latitude_deg * units.DEG, params.gravity_m_s2, units.EARTH_RATE, vertical=params.vertical)
    attitude = rotation_nb(*(np.array([params.heading_deg, params.pitch_deg, params.roll_deg]) * units.DEG))
    gyro, accelerometer, basis = _errors(evidence, params, unit, place, attitude)
    alignment = _alignment(params)
    growth = error_growth(place, attitude, gyro, accelerometer, alignment, params.hours * units.HOUR)
    hour = growth if params.hours == 1.0 else error_growth(place, attitude, gyro, accelerometer, alignment, units.HOUR)
    radius = radius_95(place, hour.total[-1])
    calibration = [hour.by_source[s][-1] for s in hour.by_source if s.endswith(" calibration")]
    own = radius_95(place, np.sum(calibration, axis=0)) if calibration else None
    uncalibrated = _uncalibrated(place, attitude, alignment, gyro, accelerometer)
    shares = tuple(
        Share(name, radius_95(place, hour.by_source[name][-1]), radius_95(place, growth.by_source[name][-1]))
        for name in growth.by_source
    )
    tilt, heading = told.greatest(growth)
    checks = [
        check("tilt, greatest standard deviation", tilt, Limit("rad", TILT_MAX_RAD, source="linear equations")),
        check(
            "heading, greatest standard deviation", heading, Limit("rad", HEADING_MAX_RAD, source="linear equations")
        ),
    ]
    if params.position_1h_max_m is not None:
        checks.append(check("position after 1 h, 95 % radius", radius, Limit("m", params.position_1h_max_m)))
    return Result(
        checks=tuple(checks),
        verdict=verdict(checks),
        warnings=told.warnings(gyro, accelerometer, params.declared is not None or LAUNCH in gyro.constant),
        basis=basis,
        sentence=told.sentence(radius, own, uncalibrated, gyro.uncalibrated is not None),
        schuler_period_s=2.0 * float(np.pi) / place.schuler_rad_s,
        time_s=tuple(growth.time_s.tolist()),
        curves=told.curves(place, growth),
        radius_95_m=tuple(radius_95(place, p) for p in growth.total),
        shares=tuple(sorted(shares, key=lambda s: -s.after_1h_m)),
        radius_95_1h_m=radius,
        calibration_radius_95_1h_m=own,
        uncalibrated_1h_m=uncalibrated,
    )


def report(result: Result) -> Report:
    """Return the report: the sentence, the sources, and a plot each of position, velocity and attitude with 95 %
    intervals.
    """
    rows = tuple((s.source, s.after_1h_m, s.at_end_m) for s in result.shares)
    end = f"after {result.time_s[-1] / units.HOUR:g} h, m"
    table = Table("95 % radius of the position by source", ("source", "after 1 h, m", end), rows, result.basis)
    return Report(result.sentence, (table, *growth.figures(result.time_s, result.curves)))


def _errors(
    evidence: Evidence, params: Params, unit: Unit | None, place: Place, attitude: Array
) -> tuple[TriadErrors, TriadErrors, str]:
    north, up = place.horizontal_rate_rad_s, place.earth_rate_rad_s * float(np.sin(place.latitude_rad))
    rate_b = attitude.T @ np.array([north, up, 0.0])
    force_b = attitude.T @ np.array([0.0, place.gravity_m_s2, 0.0])
    if params.declared is not None:
        return *_declared(params.declared, rate_b, force_b), "declared standard uncertainties"
    triads, basis = _calibration(evidence, unit)
    by_name = {c.triad: c for c in triads}
    missing = [name for name in ("gyro", "accelerometer") if name not in by_name]
    if missing:
        raise BadParameter(
            "calibrations", len(evidence.calibrations), f"the {missing[0]} triad is missing; give one, or `declared`"
        )
    found = [
        calibrated_triad(by_name[name], unit.triad(name) if unit else None, vector)
        for name, vector in (("gyro", rate_b), ("accelerometer", force_b))
    ]
    return found[0], found[1], basis


def _calibration(evidence: Evidence, unit: Unit | None) -> tuple[tuple[TriadCalibration, ...], str]:
    if evidence.calibrations:
        return tuple(evidence.one_each().values()), evidence.calibrations_in_words
    if unit is None:
        raise BadParameter("calibrations", 0, "give a calibration, a recording of a calibrated unit, or `declared`")
    found = [known for triad in TRIAD_NAMES if (known := unit.calibration(triad)) is not None]
    return tuple(found), f"the current {unit.calibration_in_words(*TRIAD_NAMES)} of unit {unit.serial}"


def _declared(d: Declared, rate_b: Array, force_b: Array) -> tuple[TriadErrors, TriadErrors]:
    deg_h, ug = units.DEG_PER_HOUR, units.MICRO_G
    gyro_noise = NoiseCoefficients(
        random_walk=d.gyro_random_walk_deg_sqrt_h * units.DEG_PER_SQRT_HOUR,
        bias_instability=d.gyro_bias_instability_deg_h * deg_h,
    )
    accelerometer_noise = NoiseCoefficients(
        random_walk=d.accelerometer_random_walk_ug_sqrt_s * ug,
        bias_instability=d.accelerometer_bias_instability_ug * ug,
    )
    gyro = declared_triad(
        d.gyro_bias_deg_h * deg_h,
        d.gyro_scale_ppm * units.PPM,
        d.gyro_misalignment_arcsec * units.ARCSEC,
        gyro_noise,
        rate_b,
    )
    accelerometer = declared_triad(
        d.accelerometer_bias_ug * ug,
        d.accelerometer_scale_ppm * units.PPM,
        d.accelerometer_misalignment_arcsec * units.ARCSEC,
        accelerometer_noise,
        force_b,
    )
    return gyro, accelerometer


def _alignment(params: Params) -> Alignment:
    if params.alignment == "self":
        return Alignment(params.alignment_s, warm_up_s=params.warm_up_s)
    tilt, heading = params.tilt_sd_arcsec * units.ARCSEC, params.heading_sd_arcsec * units.ARCSEC
    return Alignment(None, tilt, heading, warm_up_s=params.warm_up_s)


def _uncalibrated(
    place: Place, attitude: Array, alignment: Alignment, gyro: TriadErrors, accelerometer: TriadErrors
) -> float | None:
    if gyro.uncalibrated is None or accelerometer.uncalibrated is None:
        return None
    inputs = np.concatenate([attitude @ gyro.uncalibrated, attitude @ accelerometer.uncalibrated])
    error = constant_error(place, alignment, inputs, units.HOUR)
    if max(abs(error[TILT_NORTH]), abs(error[TILT_EAST])) > TILT_MAX_RAD or abs(error[HEADING]) > HEADING_MAX_RAD:
        return None
    return float(np.linalg.norm(place.metres @ error))


METHOD = Method("error_growth", "Error growth of a parked navigator", "1.0.0", Params, Result, analyse, report)
