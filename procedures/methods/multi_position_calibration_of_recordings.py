"""Calibration of both triads, or one, from recordings at rest in any positions, of any job or import.

The positions are the stations' table angles, angles given here, or the directions of "up" in the unit's axes for the
accelerometers alone (thesis 3.3.3-3.3.6).
"""

from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from procedures import multi_position
from procedures.analysis.calibration.reference_temperature import LEAST_DWELL_S, require_correctable
from procedures.analysis.calibration.table_errors import TableUncertainty, direction_errors
from procedures.core import units
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import TRIADS
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.unit import Unit
from procedures.core.unit_correction import CorrectionKind
from procedures.multi_position import FitParameters, Inputs, Result
from procedures.procedure import STATIONS, Evidence, Method, RecordedParameters

Angle = Annotated[float, Field(ge=-3600.0, le=3600.0)]
Component = Annotated[float, Field(ge=-1e6, le=1e6)]
Lag = Annotated[float, Field(ge=0.0, le=600.0)]
Arcsec = Annotated[float, Field(ge=0.0, le=36_000.0)]


class Params(FitParameters, RecordedParameters):
    """Positions and site of the recordings. Latitude and gravity have no default: they depend on the place."""

    gravity_m_s2: float = Field(ge=9.7, le=9.9)
    gravity_sd_m_s2: float = Field(1e-5, ge=0.0, le=0.01)
    latitude_deg: float | None = Field(None, ge=-90.0, le=90.0, description="needed by the gyros")
    latitude_sd_arcsec: Arcsec = 0.0
    azimuth_deg: float = Field(0.0, ge=-360.0, le=360.0, description="heading of the table's zero")
    azimuth_sd_arcsec: Arcsec = 0.0
    positions: tuple[tuple[Angle, Angle, Angle], ...] | None = Field(
        None,
        min_length=1,
        max_length=500,
        description="(outer, middle, inner) [deg], one a recording, in their order; None: the stations' own angles",
    )
    directions: tuple[tuple[Component, Component, Component], ...] | None = Field(
        None,
        min_length=1,
        max_length=500,
        description="up in the unit's axes, of any length, one a recording; accelerometers alone; not with positions",
    )
    direction_sd_arcsec: Arcsec = Field(0.0, description="standard uncertainty of each direction, about any axis")
    orthogonality_sd_arcsec: Arcsec = 0.0
    pointing_sd_arcsec: Arcsec = 0.0
    level_sd_arcsec: Arcsec = 0.0
    thermal_correction: Literal["none", "current"] = Field(
        "none", description="current: the unit's corrections bring both triads to their reference temperatures"
    )
    case_lag_s: Lag = Field(5.0, description="time constant of the case sensor; used by thermal_correction=current")
    converter_lag_s: Lag = Field(5.0, description="time constant of the converter's sensor")


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the calibration by least squares over the means of the recordings. Raises `BadParameter`,
    `UnfitRecording`, `Undetermined`.
    """
    if not evidence.recordings:
        raise UnfitRecording("there is no recording to calibrate from")
    if params.directions is not None:
        inputs = {"accelerometer": _from_directions(params, len(evidence.recordings))}
    else:
        inputs = _from_angles(evidence, params)
    if params.thermal_correction == "none":
        return multi_position.calibrated(evidence.recordings, params, inputs, unit)
    if unit is None or "accelerometer" not in params.triads:
        way_out = "none: it needs the recordings' unit, and accelerometer among the triads"
        raise BadParameter("thermal_correction", "current", way_out)
    require_correctable("current", None, unit)
    shortest = min(evidence.recordings, key=lambda r: r.info.duration_s).info
    if shortest.duration_s < LEAST_DWELL_S:
        raise UnfitRecording(
            f"recording {shortest.id} lasts {shortest.duration_s:g} s: thermal_correction=current needs at least "
            f"{LEAST_DWELL_S:g} s, in which the temperatures are read too"
        )
    lags = params.case_lag_s, params.converter_lag_s
    return multi_position.calibrated(evidence.recordings, params, inputs, unit, lags)


def uses_corrections(result: Result) -> tuple[CorrectionKind, ...]:
    """Return the kinds of the unit's current corrections that brought the triads of the result to their references."""
    if result.thermal is None:
        return ()
    return ("thermal", "gyros") if any(t.calibration.triad == "gyro" for t in result.triads) else ("thermal",)


def _from_directions(params: Params, recordings: int) -> Inputs:
    if params.positions is not None:
        raise BadParameter(
            "directions", len(params.directions or ()), "not together with positions: give one of the two"
        )
    if "gyro" in params.triads:
        raise BadParameter(
            "triads",
            params.triads,
            "('accelerometer',): a direction of up does not show where north is, give positions",
        )
    given = np.array(params.directions)
    _require_one_each("directions", len(given), recordings)
    lengths = np.linalg.norm(given, axis=1)
    if np.any(lengths == 0.0):
        raise BadParameter(f"directions[{int(np.argmin(lengths))}]", (0.0, 0.0, 0.0), "a vector that is not zero")
    vectors = params.gravity_m_s2 * given / lengths[:, None]
    relative = params.gravity_sd_m_s2 / params.gravity_m_s2
    errors = direction_errors(vectors, params.direction_sd_arcsec * units.ARCSEC, relative)
    return Inputs(vectors, errors, params.gravity_m_s2)


def _from_angles(evidence: Evidence, params: Params) -> dict[str, Inputs]:
    angles = _angles(evidence, params)
    if params.latitude_deg is None and "gyro" in params.triads:
        raise BadParameter("latitude_deg", None, "−90 … 90: the gyros are calibrated by the Earth's rate; or triads")
    site = Site(
        params.latitude_deg or 0.0,
        params.gravity_m_s2,
        params.azimuth_deg,
        params.azimuth_sd_arcsec,
        params.gravity_sd_m_s2,
    )
    uncertainty = TableUncertainty(
        params.orthogonality_sd_arcsec,
        params.pointing_sd_arcsec,
        params.level_sd_arcsec,
        params.azimuth_sd_arcsec,
        params.gravity_sd_m_s2 / params.gravity_m_s2,
        latitude_sd_arcsec=params.latitude_sd_arcsec,
    )
    return multi_position.inputs_at(params.triads, angles, site, uncertainty)


def _angles(evidence: Evidence, params: Params) -> list[TableAngles]:
    if params.positions is not None:
        _require_one_each("positions", len(params.positions), len(evidence.recordings))
        return [TableAngles(*position) for position in params.positions]
    found: list[TableAngles] = []
    for recording in evidence.recordings:
        station = recording.info.station
        if station is None or station.angles is None:
            raise BadParameter(
                "positions", None, f"table angles or directions: recording {recording.info.id} has no angles of its own"
            )
        found.append(station.angles)
    return found


def _require_one_each(field: str, given: int, recordings: int) -> None:
    if given != recordings:
        raise BadParameter(field, f"{given} of them", f"one for each of the {recordings} recordings, in their order")


METHOD = Method(
    "multi_position_calibration_of_recordings",
    "Calibration in any positions, of recordings",
    "1.1.0",
    Params,
    Result,
    analyse,
    multi_position.report,
    multi_position.calibrations,
    uses_corrections=uses_corrections,
    planned_checks=lambda params, unit, _: multi_position.planned_residuals(
        params, [triad for triad in params.triads if unit.triad(triad) is not None]
    ),
    inspection=lambda params, _: replace(
        STATIONS, channels=tuple(channel for triad in params.triads for channel in TRIADS[triad])
    ),
)
