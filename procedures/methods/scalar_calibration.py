"""Scalar calibration of a triad: nine parameters from the magnitude alone (thesis 3.3.1, 3.21-3.24).

For recordings at several stations, or for one long recording of a unit turned by hand from pose to pose.
"""

from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from procedures.analysis.calibration.misfit import (
    MISFIT_MAX,
    Misfit,
    require_live,
    require_plausible_scales,
    scalar_misfit,
)
from procedures.analysis.calibration.poses import Poses, rows_as_poses, station_poses
from procedures.analysis.calibration.reference import INPUT_UNITS
from procedures.analysis.calibration.scalar import (
    PARAMETERS,
    ScalarFit,
    fit_from_starts,
    nominal_start,
    starts_from_data,
)
from procedures.analysis.calibration.slow_noise import slow_share
from procedures.analysis.calibration.station_noise import outputs_covariance
from procedures.analysis.calibration.still import StillSettings, pose_excess, pose_means, require_poses, still_stretches
from procedures.analysis.calibration.triad_analysis import scatter_covariance
from procedures.analysis.fitness.watched import Inspection
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Check, check, verdict
from procedures.core.recording import TRIADS, Recording, rates, require_finite
from procedures.core.report import Figure, Report, Series, Table
from procedures.core.unit import Unit
from procedures.parameters import largest, level_check, planned_tests
from procedures.procedure import STATIONS, Evidence, Method, Outcome, Parameters, RecordedParameters
from procedures.triad_checks import RESIDUALS

TURNED = replace(STATIONS.settings, at_rest=False, beside_others=False)
"""One recording of a unit that is turned by hand from pose to pose."""
LEAST_TO_JUDGE = 6
"""Least number of poses to judge a channel that none of them changes as dead or not turned; below it the rank does."""


class Still(Parameters):
    """Criteria by which poses are found in one long recording."""

    initial_s: float = Field(20.0, gt=0.0, le=3600.0, description="the unit rests for this long at the beginning")
    window_s: float = Field(1.0, gt=0.0, le=60.0, description="window of the moving variance")
    factor: float = Field(10.0, gt=1.0, le=1000.0, description="threshold over the initial variance")
    shortest_s: float = Field(1.0, gt=0.0, le=3600.0)
    margin_s: float = Field(0.25, ge=0.0, le=60.0, description="cut from both ends of each pose")


class Params(RecordedParameters):
    """Triad, and the reference magnitude: gravity has no default, it depends on the place."""

    triad: Literal["accelerometer", "gyro"] = "accelerometer"
    gravity_m_s2: float | None = Field(None, ge=9.7, le=9.9, description="needed for the accelerometers")
    earth_rate_rad_s: float = Field(units.EARTH_RATE, ge=7.0e-5, le=7.6e-5)
    rows: Literal["samples", "pose_means"] = Field(
        "samples",
        description="samples: still stretches of one recording are found; pose_means: each row is the mean of a pose",
    )
    pose_sd: float | None = Field(
        None,
        gt=0.0,
        description="standard uncertainty of pose means, in the recording's unit; None: from the residuals",
    )
    still: Still = Field(default_factory=lambda: Still.model_validate({}))
    uncertainty_max: float = Field(
        0.01,
        gt=0.0,
        le=1.0,
        description="beyond it a parameter counts as undetermined: rad, or relative to the reference",
    )
    condition_max: float = Field(
        1000.0, ge=1.0, le=1e9, description="largest condition number of the linear system of thesis 3.23"
    )
    residual_p_value_min: float = Field(0.001, ge=0.0, le=1.0)
    misfit_max: float = Field(
        MISFIT_MAX,
        gt=1.0,
        le=1e6,
        description="where the noise comes from the data: residuals over what the scatter within the poses allows",
    )

    @model_validator(mode="after")
    def _gravity_is_given(self) -> Self:
        if self.triad == "accelerometer" and self.gravity_m_s2 is None:
            raise ValueError("gravity_m_s2 is needed for the accelerometers: there is no default for a place")
        return self


@dataclass(frozen=True)
class Estimate:
    """Coefficient of the scalar model, one of nine."""

    name: str
    unit: str
    estimate: float
    standard_uncertainty: float


class Result(Outcome):
    """``v̂ = T·S·(U − b)``, T upper triangular with a unit diagonal."""

    calibration: TriadCalibration
    parameters: tuple[Estimate, ...]
    """b in the output's unit, s in SI per output unit, t in rad."""
    reference: float
    poses: int
    condition: float
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    residuals: tuple[float, ...]
    """|v̂| − reference per pose, SI."""
    residual_sd: tuple[float, ...]
    misfit: float | None = None
    """Residuals over what the scatter within the poses allows; None where no equation is spare."""
    worst: str = ""
    """Pose and channels with the greatest residual."""


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the nine parameters of a triad; several recordings are one pose each, a single one is searched for still
    stretches. Raises `UnfitRecording`, `Undetermined`, `MissingChannel`.
    """
    recordings = evidence.recordings
    poses = (
        _poses_of_one(recordings[0], params, unit)
        if len(recordings) == 1
        else station_poses(recordings, params.triad, unit)
    )
    if len(poses.outputs) >= LEAST_TO_JUDGE:
        require_live(params.triad, poses.outputs, poses.output_unit)
    reference = _reference(params)
    in_counts = poses.output_unit == "count"
    starts = starts_from_data(poses.outputs, reference) if in_counts else (nominal_start(),)
    what = f"the nine scalar {params.triad} parameters"
    fit = fit_from_starts(what, poses.outputs, poses.noise, reference, starts, poses.known)
    gains: Array = np.diagonal(np.linalg.inv(fit.correction)).astype(np.float64)
    require_plausible_scales(params.triad, gains, poses.output_unit != "count")
    return _result(fit, params, poses)


def calibrations(result: Result) -> tuple[TriadCalibration, ...]:
    """Return the nine parameters as a calibration ``U = b + K·v``, K upper triangular."""
    return (result.calibration,)


def report(result: Result) -> Report:
    """Return the report: parameters, checks, and the magnitude's residual of every pose."""
    rows = tuple((p.name, p.unit, p.estimate, p.standard_uncertainty) for p in result.parameters)
    columns = ("parameter", "unit", "estimate", "± standard uncertainty")
    table = Table("Scalar calibration", columns, rows, "v̂ = T·S·(U − b), T upper triangular with a unit diagonal.")
    unit, size = units.DISPLAY[result.calibration.input_unit]
    x = tuple(float(i) for i in range(1, result.poses + 1))
    errors = tuple(s / size for s in result.residual_sd)
    points = Series("residual", x, tuple(r / size for r in result.residuals), errors)
    zero = Series("zero", x, (0.0,) * len(x), style="reference")
    figure = Figure("Magnitude at each pose", "pose", f"|v̂| − reference, {unit}", (points, zero))
    return Report(f"{result.poses} poses.", (table, figure))


def _reference(params: Params) -> float:
    return params.earth_rate_rad_s if params.triad == "gyro" else params.gravity_m_s2 or 0.0


def _poses_of_one(recording: Recording, params: Params, unit: Unit | None) -> Poses:
    """The still stretches of one recording."""
    info, s = recording.info, params.still
    names = TRIADS[params.triad]
    samples = rates(recording, names)
    require_finite(info, names, samples)
    if params.rows == "pose_means":
        return rows_as_poses(recording, samples, params.triad, params.pose_sd, unit)
    settings = StillSettings(s.initial_s, s.window_s, s.factor, s.shortest_s, s.margin_s)
    stretches = still_stretches(samples, info.rate_hz, settings)
    require_poses(info.id, stretches, len(PARAMETERS), settings)
    outputs, sd = pose_means(samples, stretches)
    output_unit = info.channels[info.column(names[0])].rate_unit
    windows = np.array([[p.start, p.stop] for p in stretches]) / info.rate_hz + info.start_s
    labels = tuple(f"pose {i} ({a:.4g} to {b:.4g} s)" for i, (a, b) in enumerate(windows.tolist(), start=1))
    known = outputs_covariance(unit.triad(params.triad) if unit else None, output_unit, windows)
    if known is not None:
        return Poses(outputs, known, True, 0.0, output_unit, labels)
    noise = scatter_covariance(outputs, np.maximum(sd, np.median(sd, axis=0)))
    return Poses(outputs, noise, False, slow_share(pose_excess(samples, stretches), noise), output_unit, labels)


def _result(fit: ScalarFit, params: Params, poses: Poses) -> Result:
    input_unit, output_unit = INPUT_UNITS[params.triad], poses.output_unit
    misfit = scalar_misfit(fit, poses.outputs, poses.labels, poses.slow)
    misfit = misfit if poses.scatters else replace(misfit, ratio=None)
    checks = _checks(fit, params, misfit)
    kinds = (
        (output_unit,) * 3 + (f"{input_unit}/{output_unit}" if output_unit != input_unit else "1",) * 3 + ("rad",) * 3
    )
    parameters = tuple(
        Estimate(name, kind, estimate, sd)
        for name, kind, estimate, sd in zip(
            PARAMETERS, kinds, fit.parameters.tolist(), fit.standard_uncertainties.tolist(), strict=True
        )
    )
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=_warnings(fit, params, misfit),
        calibration=fit.calibration(params.triad, output_unit, input_unit),
        parameters=parameters,
        reference=_reference(params),
        poses=len(fit.residuals),
        condition=fit.condition,
        chi_square=fit.chi_square,
        degrees_of_freedom=fit.degrees_of_freedom,
        p_value=fit.p_value,
        residuals=tuple(fit.residuals.tolist()),
        residual_sd=tuple(fit.residual_sd.tolist()),
        misfit=misfit.ratio,
        worst=misfit.worst,
    )


def _checks(fit: ScalarFit, params: Params, misfit: Misfit) -> tuple[Check, ...]:
    relative = _relative_sd(fit, params)
    checks = [
        check("condition number", fit.condition, largest(params, "condition_max", "1")),
        check(
            "greatest relative standard uncertainty of a parameter",
            float(relative.max()),
            largest(params, "uncertainty_max", "1"),
            note=f"{PARAMETERS[int(np.argmax(relative))]}; beyond the limit it is practically undetermined",
        ),
    ]
    if fit.p_value is not None:
        checks.append(level_check(params, "residual_p_value_min", RESIDUALS, fit.p_value, f"worst: {misfit.worst}"))
    elif not fit.noise_known:
        checks += misfit.checks(
            "residuals over the scatter within the poses", params.misfit_max, params.source_of("misfit_max")
        )
    return tuple(checks)


def _relative_sd(fit: ScalarFit, params: Params) -> Array:
    """Relative standard uncertainties (9,): of b by the reference in the output's unit, of s relative, of t in rad."""
    scale = np.abs(fit.parameters[3:6])
    return fit.standard_uncertainties / np.concatenate([_reference(params) / scale, scale, np.ones(3)])


def _warnings(fit: ScalarFit, params: Params, misfit: Misfit) -> tuple[str, ...]:
    """Parameters that the poses leave practically open, noise that had to be taken from the data, and a misfit."""
    found = [
        f"{name} is practically undetermined by these poses: its standard uncertainty is {value:.2g} "
        f"({'rad' if name.startswith('t') else 'relative'})"
        for name, value in zip(PARAMETERS, _relative_sd(fit, params).tolist(), strict=True)
        if value > params.uncertainty_max
    ]
    if not fit.noise_known:
        found.append("the noise is not known: uncertainties come from the scatter within the poses and the residuals")
    return (*found, *misfit.sentences)


def inspection(params: Params, count: int) -> Inspection:
    """Return the settings of the inspection: poses at rest against each other, or one recording of a unit turned by
    hand.
    """
    return replace(STATIONS, channels=TRIADS[params.triad]) if count > 1 else Inspection(TURNED, TRIADS[params.triad])


METHOD = Method(
    "scalar_calibration",
    "Scalar calibration",
    "1.1.0",
    Params,
    Result,
    analyse,
    report,
    calibrations,
    planned_checks=lambda params, _unit, _planned: planned_tests(params, "residual_p_value_min", RESIDUALS),
    inspection=inspection,
)
