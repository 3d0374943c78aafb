"""Field calibration, without a bench: bias and scale of a unit turned by hand through a few positions (F).

Accelerometers from two positions, zero and (α, β), or from more with the tilt of the base found along (paper F
11-34); gyros' bias alone where they cannot feel the Earth's rate, bias and scale where they can (paper F 36, 45-48).
Cross-couplings are neglected, and their effect is in the uncertainty. Errata of paper F:
`procedures.analysis.field.positions`.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from procedures.analysis.calibration.misfit import (
    MISFIT_MAX,
    REMARKABLE,
)
from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.station_means import station_means
from procedures.analysis.calibration.triad_analysis import noise_of_means
from procedures.analysis.field.examined import FittedTriad, examined_fit, require_accelerometers
from procedures.analysis.field.fit import FieldFit, FieldModel, FieldUncertainty
from procedures.analysis.field.summary import FieldTriad, field_summary
from procedures.analysis.fitness.watched import Inspection
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Check, check, verdict
from procedures.core.recording import ACCELEROMETER, GYRO, TRIADS, Recording
from procedures.core.report import Report, Table
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.unit import Unit
from procedures.parameters import largest, level_check, planned_tests
from procedures.procedure import STATIONS, Evidence, Method, Outcome, RecordedParameters
from procedures.triad_checks import RESIDUALS

Angle = Annotated[float, Field(ge=-360.0, le=360.0)]


class Params(RecordedParameters):
    """Positions of the unit, and their uncertainties. Latitude and gravity depend on the place and have no default."""

    latitude_deg: float = Field(ge=-90.0, le=90.0)
    gravity_m_s2: float = Field(ge=9.7, le=9.9)
    azimuth_deg: float = Field(0.0, ge=-360.0, le=360.0, description="of the unit's x in position zero; F: -90")
    positions: tuple[tuple[Angle, Angle], ...] | None = Field(
        None, min_length=2, max_length=200, description="(α, β) [deg] of each recording; None: its table angles"
    )
    tilt: Literal["level", "base", "turn_zeros"] = Field(
        "level",
        description="level: the base is level within level_sd; base: its tilt is estimated; turn_zeros: the zeros of "
        "the two turns are (F 15)",
    )
    gyro: Literal["none", "bias", "bias_and_scale"] = Field(
        "bias", description="bias: tactical grade, scale factor nominal; bias_and_scale: from the Earth's rate"
    )
    angle_sd_arcsec: float = Field(
        60.0, ge=0.0, le=36_000.0, description="standard uncertainty of each turn set by hand"
    )
    level_sd_arcsec: float = Field(
        60.0, ge=0.0, le=36_000.0, description="standard uncertainty of a base taken as level by a spirit level"
    )
    azimuth_sd_arcsec: float = Field(
        3600.0, ge=0.0, le=360_000.0, description="standard uncertainty of the azimuth by a compass"
    )
    cross_coupling_sd: float = Field(
        0.001, ge=0.0, le=0.1, description="standard uncertainty of each of the six neglected cross-couplings"
    )
    gravity_relative_sd: float = Field(1e-5, ge=0.0, le=0.01)
    gyro_scale_sd: float = Field(
        0.01, ge=0.0, le=0.5, description="relative standard uncertainty of a nominal scale factor"
    )
    lever_min: float = Field(0.02, gt=0.0, le=1.0, description="least change of a channel's input, relative")
    scale_sd_max: float = Field(0.1, gt=0.0, le=1.0, description="relative; a worse scale factor is refused")
    scale_sd_limit: float = Field(0.005, gt=0.0, le=1.0, description="relative; a worse accelerometer fails")
    residual_p_value_min: float = Field(0.001, ge=0.0, le=1.0)
    misfit_max: float = Field(
        MISFIT_MAX,
        gt=1.0,
        le=1e6,
        description="where the noise comes from the data: residuals over what it and the declared uncertainties allow",
    )


class Result(Outcome):
    """The triads, and the tilt where it was estimated."""

    triads: tuple[FieldTriad, ...]
    tilt_deg: tuple[float, float] | None
    """Tilt of the base (α₀, β₀); None: taken as level."""
    tilt_sd_deg: tuple[float, float] | None
    tilt_model: str


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the calibration from one recording a position. Raises `Undetermined` where they do not determine it.

    Also `UnfitRecording` for fewer than two recordings or an unfit one, and `BadParameter` where positions are missing.
    """
    require_accelerometers(evidence.recordings)
    positions = _positions(evidence.recordings, params)
    fitted = _accelerometer(evidence.recordings, positions, params, unit)
    accelerometer, triads = fitted.fit, [field_summary(fitted, params.cross_coupling_sd, estimated=True)]
    if params.gyro != "none":
        gyro = _gyro(evidence.recordings, positions, params, unit, accelerometer)
        triads.append(field_summary(gyro, params.cross_coupling_sd, params.gyro == "bias_and_scale"))
    checks = tuple(_checks(triads, params))
    estimated = params.tilt != "level"
    sd = np.sqrt(np.diagonal(accelerometer.covariance)[6:]) / units.DEG
    tilt = accelerometer.tilt_rad / units.DEG
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=tuple(_warnings(triads, accelerometer, params)),
        triads=tuple(triads),
        tilt_deg=(float(tilt[0]), float(tilt[1])) if estimated else None,
        tilt_sd_deg=(float(sd[0]), float(sd[1])) if estimated else None,
        tilt_model=params.tilt,
    )


def calibrations(result: Result) -> tuple[TriadCalibration, ...]:
    """Return the calibrations with diagonal K, model "field"."""
    return tuple(t.calibration for t in result.triads)


def report(result: Result) -> Report:
    """Return the report: bias and scale of every channel, and the tilt."""
    rows = tuple(
        (
            f"{t.calibration.triad} {axis}",
            name,
            t.bias[c] / size,
            t.bias_sd[c] / size,
            t.scale[c],
            t.scale_relative_sd[c],
        )
        for t in result.triads
        for name, size in (units.DISPLAY[t.calibration.output_unit],)
        for c, axis in enumerate("xyz")
    )
    columns = ("channel", "unit", "bias", "±", "scale", "± relative")
    note = "" if result.tilt_deg is None else f"tilt α₀ = {result.tilt_deg[0]:.4g}°, β₀ = {result.tilt_deg[1]:.4g}°"
    return Report(note, (Table("Field calibration", columns, rows, "U = b + k·v; cross-couplings are neglected."),))


def _positions(recordings: Sequence[Recording], params: Params) -> list[TableAngles]:
    if len(recordings) < 2:
        raise UnfitRecording(f"{len(recordings)} recording(s): at least two positions are needed")
    if params.positions is not None:
        if len(params.positions) != len(recordings):
            raise BadParameter("positions", len(params.positions), f"one for each of the {len(recordings)} recordings")
        return [TableAngles(0.0, alpha, beta) for alpha, beta in params.positions]
    found: list[TableAngles] = []
    for recording in recordings:
        station = recording.info.station
        if station is None or station.angles is None:
            raise BadParameter("positions", None, f"recording {recording.info.id} has no angles: give the positions")
        if station.angles.outer_deg != 0.0:
            turned = (
                f"recording {recording.info.id} was made at an outer angle, and this method knows only the other two"
            )
            raise BadParameter("positions", None, f"{turned}: give the positions")
        found.append(station.angles)
    return found


def _accelerometer(
    recordings: Sequence[Recording], positions: list[TableAngles], params: Params, unit: Unit | None
) -> FittedTriad:
    level = (params.level_sd_arcsec * units.ARCSEC) ** 2
    uncertainty = FieldUncertainty(
        params.angle_sd_arcsec * units.ARCSEC,
        ((level, 0.0), (0.0, level)),
        0.0,
        params.cross_coupling_sd,
        params.gravity_relative_sd,
    )
    return _fit("accelerometer", recordings, unit, _model("accelerometer", positions, params, None), uncertainty)


def _gyro(
    recordings: Sequence[Recording],
    positions: list[TableAngles],
    params: Params,
    unit: Unit | None,
    accelerometer: FieldFit,
) -> FittedTriad:
    """Calibrate the gyros on the base as the accelerometers found it."""
    level = (params.level_sd_arcsec * units.ARCSEC) ** 2
    tilt = accelerometer.covariance[6:, 6:] if params.tilt != "level" else level * np.eye(2)
    uncertainty = FieldUncertainty(
        params.angle_sd_arcsec * units.ARCSEC,
        ((float(tilt[0, 0]), float(tilt[0, 1])), (float(tilt[1, 0]), float(tilt[1, 1]))),
        params.azimuth_sd_arcsec * units.ARCSEC,
        params.cross_coupling_sd,
        0.0,
        params.gyro_scale_sd,
    )
    return _fit("gyro", recordings, unit, _model("gyro", positions, params, accelerometer), uncertainty)


def _model(triad: str, positions: list[TableAngles], params: Params, accelerometer: FieldFit | None) -> FieldModel:
    site = Site(params.latitude_deg, params.gravity_m_s2, params.azimuth_deg)
    vector: Array = reference_vectors(triad, [TableAngles()], site)[0]
    alpha_beta = np.array([[p.middle_deg, p.inner_deg] for p in positions]) * units.DEG
    tilt = (0.0, 0.0) if accelerometer is None else (float(accelerometer.tilt_rad[0]), float(accelerometer.tilt_rad[1]))
    return FieldModel(
        alpha_beta,
        vector,
        "turn_zeros" if params.tilt == "turn_zeros" else "base",
        params.tilt != "level" and triad == "accelerometer",
        tilt,
        triad == "accelerometer" or params.gyro == "bias_and_scale",
        params.lever_min,
        params.scale_sd_max,
    )


def _fit(
    triad: str, recordings: Sequence[Recording], unit: Unit | None, model: FieldModel, uncertainty: FieldUncertainty
) -> FittedTriad:
    means = station_means(recordings, triad)
    if means.output_unit == "count" and not model.estimate_scale:
        raise UnfitRecording(
            f"the {triad} channels are in counts: without a scale factor the Earth's rate stays in them"
        )
    noise, known = noise_of_means(means, unit.triad(triad) if unit else None)
    what = f"bias and scale of the {triad} triad in the field"
    return examined_fit(what, means, noise, known, model, uncertainty)


def _checks(triads: Sequence[FieldTriad], params: Params) -> list[Check]:
    limit = largest(params, "scale_sd_limit", "1")
    greatest = max(triads[0].scale_relative_sd)
    found = [check("accelerometer scale factor, greatest relative standard uncertainty", greatest, limit)]
    for t in triads:
        note = "; ".join(filter(None, (f"worst: {t.worst}", t.suspected)))
        name = t.calibration.triad
        if t.p_value is not None:
            found.append(level_check(params, "residual_p_value_min", f"{name} {RESIDUALS}", t.p_value, note))
        elif t.misfit is not None:
            limit = largest(params, "misfit_max", "1")
            found.append(check(f"{name} residuals over what noise and positions allow", t.misfit, limit, note=note))
    return found


def _warnings(triads: Sequence[FieldTriad], accelerometer: FieldFit, params: Params) -> list[str]:
    unknown = "the noise is not known: uncertainties come from the scatter within the recordings"
    found = [] if accelerometer.noise_known else [unknown]
    for t in triads:
        name = t.calibration.triad
        if t.degrees_of_freedom == 0:
            found.append(
                f"{name}: as many unknowns as measurements, nothing is left to check the fit with: nothing shows "
                "whether the base moved or was tilted, or a position is wrong"
            )
        elif t.misfit is not None and t.misfit > REMARKABLE:
            why = f"; {t.suspected}" if t.suspected else ""
            found.append(
                f"{name}: the residuals are {t.misfit:.3g} times what noise and declared positions allow, the worst "
                f"at {t.worst}{why}"
            )
    if params.tilt == "level":
        bias = params.gravity_m_s2 * units.DEG
        found.append(f"a base tilted by one degree makes the horizontal biases wrong by {bias:.2g} m/s^2: see tilt")
    return found


def inspection(params: Params, count: int) -> Inspection:
    """Return the settings of the inspection: positions at rest, of the triads that are calibrated."""
    return replace(STATIONS, channels=ACCELEROMETER if params.gyro == "none" else GYRO + ACCELEROMETER)


METHOD = Method(
    "field_calibration",
    "Field calibration",
    "1.1.0",
    Params,
    Result,
    analyse,
    report,
    calibrations,
    planned_checks=lambda params, _unit, _planned: planned_tests(
        params, "residual_p_value_min", *(f"{triad} {RESIDUALS}" for triad in TRIADS)
    ),
    inspection=inspection,
)
