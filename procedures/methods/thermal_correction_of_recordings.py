"""Thermal correction of the accelerometers from recordings of a thermal cycle, imported ones too (thesis 3.2, 4.1-4.2).

Each recording is one launch at rest with one axis of the unit upwards, over soaks and ramps, with one temperature
channel or two. The correction joins the unit's history and counts when a person says so; where it is used beyond the
temperatures of these recordings, the use says so.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from procedures.analysis.cells import cell_means
from procedures.analysis.fitness.watched import Inspection
from procedures.analysis.thermal.cycle.fitted_range import range_of
from procedures.analysis.thermal.cycle.runs import felt_forces
from procedures.analysis.thermal.fit import AxisFit, fit_correction
from procedures.analysis.thermal.regime import RegimeSettings, regimes
from procedures.analysis.thermal.runs import ThermalRun, thermal_run, without_lag
from procedures.core.arrays import Array
from procedures.core.converter import at_reference
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.frames import upward_axis
from procedures.core.limits import Check, check, verdict
from procedures.core.recording import ACCELEROMETER, AXES, Recording
from procedures.core.report import Report, Table
from procedures.core.thermal_correction import COEFFICIENTS, Form, ThermalCorrection
from procedures.core.unit import Unit
from procedures.core.unit_correction import CorrectionKind, UnitCorrection
from procedures.parameters import largest
from procedures.procedure import STATIONS, Evidence, Method, Outcome, RecordedParameters
from procedures.reports.thermal_tables import OF_COEFFICIENT
from procedures.thermal_parameters import Regime

SECOND_S = 1.0
ORDER = 2
"""Order of the polynomials of thesis 4.1; the others are compared with it."""
Lag = Annotated[float, Field(ge=0.0, le=600.0)]


class Params(RecordedParameters):
    """Axis that stood upwards in each recording, the sensors, corrections applied first, and the limit of the
    residuals.
    """

    up: tuple[Literal["x", "y", "z"], ...] | None = Field(
        None, min_length=1, max_length=100, description="axis upwards, one a recording; None: by the stations' angles"
    )
    gravity_m_s2: float = Field(ge=9.7, le=9.9, description="gravity where they were recorded")
    case_sensor: str = Field("temperature_case", description="channel that stands for the unit's temperature_case")
    converter_sensor: str | None = Field(
        "temperature_converter",
        description="channel that stands for the unit's temperature_converter; None: one sensor explains all",
    )
    case_lag_s: Lag = Field(5.0, description="time constant of the sensor, by its data sheet")
    converter_lag_s: Lag = 5.0
    lag_sd_s: Lag = Field(0.05, description="standard uncertainty of each time constant")
    thermometers: bool = Field(True, description="correct sensors by the unit's current calibration of thermometers")
    converter: bool = Field(True, description="take out the unit's current models of its converter first (stage one)")
    reference_case_c: float = Field(
        20.0, ge=-100.0, le=200.0, description="reading at which the correction does nothing"
    )
    reference_converter_c: float = Field(20.0, ge=-100.0, le=200.0)
    cell_s: float = Field(60.0, ge=1.0, le=600.0, description="cells that the fits work on")
    regime: Regime = Field(default_factory=lambda: Regime.model_validate({}))
    three_sigma_m_s2: float = Field(
        0.0005, gt=0.0, le=100.0, description="largest 3σ of each axis' residuals at soaks, in sample (thesis 4.3)"
    )


@dataclass(frozen=True)
class AxisResult:
    """Fit of one accelerometer: uncertainties, spread before and after, tests of the order."""

    axis: str
    standard_uncertainties: tuple[float, ...]
    """Standard uncertainties of α1 … α4, β1 … β4."""
    before_sd_m_s2: float
    """Spread of the cells about their recording's mean."""
    static_sd_m_s2: float | None
    """Root mean square of the residuals while the temperature stands; None where it never does."""
    dynamic_sd_m_s2: float | None
    condition: float
    bic: tuple[float, ...]
    """Information criterion of the orders 1 … 5."""
    f_tests: tuple[float, ...]
    preferred_order: int
    reason: str


class Result(Outcome):
    """The correction, how well it fits each axis, and the temperatures that it was fitted at."""

    correction: ThermalCorrection
    axes: tuple[AxisResult, ...]
    sensors: tuple[str, ...]
    thermometers: str
    """Id of the calibration of thermometers that was used; empty: readings as they are."""


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return thesis 4.1 fitted to all recordings at once. Raises `BadParameter`, `MissingChannel`, `UnfitRecording`,
    and `Undetermined` with the combinations that are lost.
    """
    recordings = evidence.recordings
    if not recordings:
        raise UnfitRecording("there is no recording to analyse")
    ups = _ups(recordings, params)
    sensors = (
        (params.case_sensor,) if params.converter_sensor is None else (params.case_sensor, params.converter_sensor)
    )
    unit = _as_wanted(unit, params, sensors)
    runs = [_run(recording, up, sensors, params, unit) for recording, up in zip(recordings, ups, strict=True)]
    form = Form.SINGLE if len(sensors) == 1 else Form.BOTH
    reference = params.reference_case_c, params.reference_converter_c if len(sensors) == 2 else params.reference_case_c
    calibration = None if unit is None else unit.calibration("accelerometer")
    if calibration is not None and calibration.output_unit != "m/s^2":
        calibration = None
    if calibration is not None:
        runs = felt_forces(runs, reference, calibration, form)
    lag_sds = (0.0, params.lag_sd_s) if form is Form.SINGLE else (params.lag_sd_s, params.lag_sd_s)
    found, fits = fit_correction(runs, reference, form, lag_sds)
    known = None if unit is None else unit.thermometers
    stage = None if unit is None else unit.converter
    correction = replace(found, fitted_range=range_of(runs), first_stage=stage, thermometers=known)
    axes = tuple(_axis(fit, runs) for fit in fits)
    checks = tuple(_check(one, params) for one in axes)
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=_warnings(axes, runs, calibration is not None, stage is None, len(sensors)),
        correction=correction,
        axes=axes,
        sensors=sensors,
        thermometers="" if unit is None or known is None else unit.thermometers_id or "",
    )


def corrections(result: Result) -> tuple[UnitCorrection, ...]:
    """Return the correction of the accelerometers for the unit's history."""
    return (UnitCorrection("thermal", result.correction),)


def uses_corrections(result: Result) -> tuple[CorrectionKind, ...]:
    """Return the kinds of the unit's current corrections that were taken out first."""
    kinds: tuple[tuple[CorrectionKind, bool], ...] = (
        ("thermometers", result.correction.thermometers is not None),
        ("converter", result.correction.first_stage is not None),
    )
    return tuple(kind for kind, used in kinds if used)


def report(result: Result) -> Report:
    """Return the report: coefficients with their uncertainties, and the fit of each axis with the reasons for its
    order.
    """
    rows = tuple(
        (one.axis, name, unit, value, sd)
        for one, axis in zip(result.axes, result.correction.axes, strict=True)
        for name, unit, value, sd in zip(
            COEFFICIENTS, OF_COEFFICIENT, (*axis.alpha, *axis.beta), one.standard_uncertainties, strict=True
        )
        if value != 0.0 or sd != 0.0
    )
    note = f"Of thesis 4.1. Fitted at: {result.correction.fitted_range}; beyond that it is extrapolated."
    columns = ("axis", "coefficient", "unit", "estimate", "± standard uncertainty")
    fits = tuple(
        (a.axis, a.before_sd_m_s2, a.static_sd_m_s2, a.dynamic_sd_m_s2, a.condition, a.preferred_order, a.reason)
        for a in result.axes
    )
    of_fit = ("axis", "before, m/s^2", "at soaks", "on ramps", "condition", "preferred order", "reason")
    return Report(
        sections=(Table("Thermal coefficients", columns, rows, note), Table("Residuals and order", of_fit, fits))
    )


def _ups(recordings: Sequence[Recording], params: Params) -> list[int]:
    """Index of the axis that stood upwards in each recording. Raises `BadParameter`."""
    if params.up is not None and len(params.up) != len(recordings):
        raise BadParameter("up", params.up, f"one for each of the {len(recordings)} recordings, in their order")
    found = [_by_angles(r) for r in recordings] if params.up is None else [AXES.index(axis) for axis in params.up]
    if len(set(found)) < len(AXES):
        stood = ", ".join(AXES[i] for i in found)
        raise BadParameter(
            "up",
            stood,
            "each of x, y, z upwards in a recording: an axis that lies level shows its bias, one that stands up its "
            "scale factor; the method temperature_dependence fits a single position",
        )
    return found


def _by_angles(recording: Recording) -> int:
    station = recording.info.station
    if station is None or station.angles is None:
        raise BadParameter("up", None, f"x, y or z for each: recording {recording.info.id} has no angles of its own")
    up = upward_axis(station.angles)
    if up is None:
        raise UnfitRecording(
            f"recording {recording.info.id}: no axis of the unit stood upwards by its station's angles; give the axes "
            "by `up` where the angles are wrong"
        )
    return up


def _as_wanted(unit: Unit | None, params: Params, sensors: Sequence[str]) -> Unit | None:
    """The unit with those of its corrections alone that are to be taken out first."""
    if unit is None:
        return None
    known = unit.thermometers
    wanted = params.thermometers and known is not None and all(known.has(s) for s in sensors)
    unit = unit if wanted else replace(unit, thermometers=None)
    return unit if params.converter and len(sensors) == 2 else replace(unit, converter=None)


def _run(recording: Recording, up: int, sensors: Sequence[str], params: Params, unit: Unit | None) -> ThermalRun:
    """Cells of one recording, which is read once. Raises `MissingChannel`, `UnfitRecording`."""
    info = recording.info
    for name, wanted in {**dict.fromkeys(ACCELEROMETER, "m/s^2"), **dict.fromkeys(sensors, "degC")}.items():
        if (found := info.channels[info.column(name)].rate_unit) != wanted:
            raise UnfitRecording(f"recording {info.id}: {name} is in {found}, the correction needs it in {wanted}")
    cells = cell_means(recording, (*ACCELEROMETER, *sensors), SECOND_S)
    output, readings = cells.rates[:3].T, cells.rates[3:]
    if unit is not None and unit.thermometers is not None:
        readings = np.array([unit.thermometers.corrected(s, r) for s, r in zip(sensors, readings, strict=True)])
    case, board = readings[0], readings[-1]
    lags = {"case": params.case_lag_s, "converter": params.converter_lag_s if len(sensors) == 2 else params.case_lag_s}
    if unit is not None and unit.converter is not None:
        output = at_reference(output, without_lag(board, cells.cell_s, lags["converter"]), unit.converter)
    return thermal_run(
        *(up, params.gravity_m_s2, cells.cell_s, {"output": output, "case": case, "converter": board}),
        cell_s=params.cell_s,
        lag_s=lags,
        trace=regimes(case, cells.cell_s, RegimeSettings(**params.regime.model_dump())),
    )


def _axis(fit: AxisFit, runs: Sequence[ThermalRun]) -> AxisResult:
    still, moving = (sd if isfinite(sd) else None for sd in fit.residual_sd_m_s2)
    outputs: list[Array] = [run.output_m_s2[:, fit.axis] for run in runs]
    before = float(np.sqrt(np.mean(np.concatenate([(v - v.mean()) ** 2 for v in outputs]))))
    return AxisResult(
        AXES[fit.axis],
        tuple(fit.correction.standard_uncertainties().tolist()),
        before * fit.correction.scale,
        None if still is None else still * fit.correction.scale,
        None if moving is None else moving * fit.correction.scale,
        fit.condition,
        fit.order.bic,
        fit.order.p_value,
        fit.order.preferred,
        fit.order.reason(ORDER),
    )


def _check(one: AxisResult, params: Params) -> Check:
    at_rest = one.static_sd_m_s2 is not None
    value = one.static_sd_m_s2 if one.static_sd_m_s2 is not None else one.dynamic_sd_m_s2 or 0.0
    note = "in sample" if at_rest else "in sample, on ramps: the temperature never stood still"
    limit = largest(params, "three_sigma_m_s2", "m/s^2", "thesis 4.3")
    return check(f"{one.axis} after correction, 3σ", 3.0 * value, limit, note=note)


def _warnings(
    axes: Sequence[AxisResult], runs: Sequence[ThermalRun], calibrated: bool, unstaged: bool, sensors: int
) -> tuple[str, ...]:
    told = [f"accelerometer {a.axis}: {a.reason}" for a in axes if a.preferred_order > ORDER]
    if len(runs) == len(AXES):
        told.append("each axis stood up in one recording: nothing shows how well the correction repeats")
    if not calibrated:
        told.append(
            "the unit has no calibration of its accelerometers in m/s²: forces were taken as those of an ideal, level "
            "seat; a horizontal axis that feels some gravity then mixes its scale's drift into its bias"
        )
    if unstaged and sensors > 1:
        told.append(
            "stage one was left out: the terms of the converter's sensor hold the converter's own drift beside the "
            "accelerometers'"
        )
    return tuple(told)


METHOD = Method(
    *("thermal_correction_of_recordings", "Thermal correction of the accelerometers, of recordings", "1.0.0"),
    *(Params, Result, analyse, report),
    corrections=corrections,
    uses_corrections=uses_corrections,
    inspection=lambda _, __: Inspection(STATIONS.settings, ACCELEROMETER, temperatures=True),
)
