"""Analysis of a thermal cycle: from runs with each axis up to a correction and its errors (thesis 4.2, paper C)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from procedures.analysis.thermal.correlation import correlation
from procedures.analysis.thermal.cycle.doubts import doubts
from procedures.analysis.thermal.cycle.fitted_range import extrapolated, range_of
from procedures.analysis.thermal.cycle.forms import RunSoaks, normalised_triad, performance_of, soak_table, soaks_of
from procedures.analysis.thermal.cycle.gyro_correction import correct_gyros
from procedures.analysis.thermal.cycle.gyros import found, gyro_noises, gyro_temperatures
from procedures.analysis.thermal.cycle.hysteresis import hysteresis
from procedures.analysis.thermal.cycle.results import (
    AccelerometerCorrelation,
    AxisFound,
    FormFound,
    RunFound,
    ThermalCycle,
)
from procedures.analysis.thermal.cycle.runs import CycleSettings, PreparedRun, prepare, with_forces
from procedures.analysis.thermal.cycle.sensors import as_temperatures, with_delay, with_thermometers
from procedures.analysis.thermal.cycle.series import CycleSeries
from procedures.analysis.thermal.cycle.traces import allan_of, leg_regimes, trace
from procedures.analysis.thermal.fit import AxisFit, fit_correction
from procedures.analysis.thermal.judgement import Corrects, corrected, magnitude
from procedures.core.converter import ConverterTriad
from procedures.core.errors import DomainError
from procedures.core.imu_model import TriadCalibration
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import AXES
from procedures.core.temperature.thermometers import ThermometerCorrection
from procedures.core.thermal_correction import AxisCorrection, Form, ThermalCorrection

CURRENT = "the unit's current correction"
SAME_REFERENCE_C = 0.05
"""The converter drifts some 1e-4 m/s² a °C: a smaller difference is below every claim."""


@dataclass(frozen=True)
class KnownOfUnit:
    """Prior knowledge of the unit before the cycle; None for what is not known."""

    converter: ConverterTriad | None = None
    calibration: TriadCalibration | None = None
    """Calibration of the accelerometers, in m/s²."""
    correction: ThermalCorrection | None = None
    gyro_noise: tuple[NoiseCoefficients, ...] | None = None
    thermometers: ThermometerCorrection | None = None
    accelerometer_noise: tuple[NoiseCoefficients, ...] | None = None


def analyse_cycle(
    series: Sequence[tuple[str, CycleSeries]],
    settings: CycleSettings,
    form: Form,
    gravity_m_s2: float,
    known: KnownOfUnit,
    *,
    judge_current: bool = False,
    noise_from_cycle: bool = True,
) -> ThermalCycle:
    """Analyse a thermal cycle from `series`, each run with the id of its recording.

    `judge_current`: 3σ, |ĝ| and Allan are those of ``known.correction``, which this cycle did not make.
    `noise_from_cycle`: gyros are tested against the noise that the cycle itself shows, not against the known one.
    Raises `BadParameter`, `Undetermined`, `UnfitRecording`.
    """
    converter = _first_stage(known, judge_current)
    thermometers = _thermometers(known, judge_current)
    if judge_current and known.correction is not None:
        settings = replace(settings, static=known.correction.static_sensors)
    warnings = [*_unknowns(known, converter), *_two_references(converter, settings)]
    temperatures = [as_temperatures(s, thermometers) for _, s in series]
    settings, following, not_found = with_delay(temperatures, settings)
    runs = [prepare(s, settings, gravity_m_s2, converter) for s in temperatures]
    if known.calibration is not None:
        runs, doubtful = with_forces(runs, settings, known.calibration)
        warnings += doubtful
    cells = [run.cells for run in runs]
    fitted, fits = fit_correction(cells, settings.reference_c, form, settings.lag_sds_s)
    correction = replace(fitted, first_stage=converter, fitted_range=range_of(cells), static_sensors=settings.static)
    correction = with_thermometers(correction, thermometers)
    judged = known.correction if judge_current and known.correction is not None else correction
    soaked = [soaks_of(run, judged.axes[0].case_reference_c) for run in runs]
    comparable = known.correction if known.correction and _comparable(known.correction, correction) else None
    forms, refused = _forms(runs, soaked, correction, settings, gravity_m_s2, comparable)
    plain = _plain(judged)
    found_runs = tuple(
        _run(recording, run, judged, plain, soak, settings, gravity_m_s2)
        for (recording, _), run, soak in zip(series, runs, soaked, strict=True)
    )
    axes = [_axis(fit, axis) for fit, axis in zip(fits, correction.axes, strict=True)]
    gyro_noise = None if noise_from_cycle else known.gyro_noise
    gyros = gyro_temperatures(runs, settings, gyro_noise)
    gyro_correction, gyros_corrected = correct_gyros(runs, gyros, settings, gyro_noise, thermometers)
    return ThermalCycle(
        judged="current" if judged is not correction else "fit",
        reference_c=settings.reference_c,
        stage_one=converter is not None,
        force_known=known.calibration is not None,
        regime_delay_s=settings.regime.delay_s,
        runs=found_runs,
        axes=(axes[0], axes[1], axes[2]),
        correction=correction,
        soaks=soak_table(runs, soaked, judged),
        magnitude_m_s2=tuple((_about_mean(r, plain, gravity_m_s2), _about_mean(r, judged, gravity_m_s2)) for r in runs),
        forms=forms,
        accelerometers=_correlations(runs, judged),
        gyros=gyros,
        gyro_noise=gyro_noises(runs, settings, known.gyro_noise),
        allan=tuple(curve for run in runs for curve in allan_of(run, judged)),
        warnings=(
            *(*warnings, *not_found, *refused, *doubts(found_runs, soaked, axes, settings)),
            *extrapolated(cells, judged),
        ),
        following=following,
        converter_lag_s=settings.converter_lag_s,
        thermometers=thermometers is not None,
        hysteresis=hysteresis(runs, soaked, judged, known.accelerometer_noise or [fit.noise for fit in fits]),
        gyro_correction=gyro_correction,
        gyros_corrected=gyros_corrected,
    )


def _first_stage(known: KnownOfUnit, judge_current: bool) -> ConverterTriad | None:
    """The converter's models to take out first: those that go with the correction that is judged."""
    if judge_current and known.correction is not None:
        return known.correction.first_stage
    return known.converter


def _thermometers(known: KnownOfUnit, judge_current: bool) -> ThermometerCorrection | None:
    """The correction of the sensors to take out first: the one that goes with the correction that is judged."""
    if judge_current and known.correction is not None:
        return known.correction.thermometers
    return known.thermometers


def _comparable(current: ThermalCorrection, fitted: ThermalCorrection) -> bool:
    """Whether a current correction is one of the same outputs and temperatures as the fitted one."""
    same = (current.first_stage, current.thermometers, current.static_sensors)
    return same == (fitted.first_stage, fitted.thermometers, fitted.static_sensors)


def _two_references(converter: ConverterTriad | None, settings: CycleSettings) -> list[str]:
    """Warning where the two stages refer to different readings of the converter's sensor."""
    if converter is None:
        return []
    first, second = converter[0].scale.reference_c, settings.reference_c[1]
    if abs(first - second) < SAME_REFERENCE_C:
        return []
    return [
        f"stage one refers to {first:g} °C of the converter's sensor, the correction to {second:g} °C: the reference "
        "is then of two temperatures; set reference_converter_c to stage one's"
    ]


def _unknowns(known: KnownOfUnit, converter: ConverterTriad | None) -> list[str]:
    warnings: list[str] = []
    if converter is None:
        warnings.append(
            "no model of the unit's signal converter is known: stage one was left out, and the terms of the "
            "converter's sensor hold the converter's own drift beside the accelerometers'"
        )
    if known.calibration is None:
        warnings.append(
            "the unit has no calibration of its accelerometers in m/s²: forces were taken as those of an ideal, level "
            "seat; a horizontal axis that feels some gravity then mixes its scale's drift into its bias"
        )
    return warnings


def _plain(correction: ThermalCorrection) -> ThermalCorrection:
    """The correction with K0 and B0 alone."""
    none = (0.0, 0.0, 0.0, 0.0)
    x, y, z = (replace(a, alpha=none, beta=none, form=Form.BOTH, dynamic_offset=(0.0, 0.0)) for a in correction.axes)
    return ThermalCorrection(correction.triad, (x, y, z))


def _forms(
    runs: Sequence[PreparedRun],
    soaked: Sequence[RunSoaks],
    correction: ThermalCorrection,
    settings: CycleSettings,
    gravity_m_s2: float,
    current: ThermalCorrection | None,
) -> tuple[tuple[FormFound, ...], list[str]]:
    """Every way to correct, side by side; a sentence for each that these runs cannot determine."""
    answers: list[FormFound] = []
    refused: list[str] = []
    cells = [run.cells for run in runs]
    chosen = correction.axes[0].form

    def add(name: str, make: Corrects) -> None:
        answers.append(performance_of(name, runs, soaked, make, gravity_m_s2))

    for form in Form:
        try:
            add(form.value, correction if form is chosen else fit_correction(cells, settings.reference_c, form)[0])
        except DomainError as refusal:
            refused.append(f"the form {form.value!r} could not be fitted for comparison: {refusal}")
    try:
        add("normalised polynomial (C)", normalised_triad(runs, soaked, settings.reference_c[0]))
    except DomainError as refusal:
        refused.append(f"C's normalised polynomial could not be fitted for comparison: {refusal}")
    _other_sensor(runs, soaked, settings, gravity_m_s2, chosen, answers, refused)
    if current is not None:
        add(CURRENT, current)
    return tuple(answers), refused


OTHER_SENSOR = {
    "case": "thesis 4.1, each axis by its own gyro's thermometer",
    "gyros": "all axes by the case's thermometer",
}
"""The other choice of the static sensor, by the one that was chosen."""


def _other_sensor(
    runs: Sequence[PreparedRun],
    soaked: Sequence[RunSoaks],
    settings: CycleSettings,
    gravity_m_s2: float,
    form: Form,
    answers: list[FormFound],
    refused: list[str],
) -> None:
    """Add the chosen form with the other choice of the static sensor, on the same cycles."""
    name, others = OTHER_SENSOR[settings.static], [replace(run, cells=run.other) for run in runs]
    try:
        made = fit_correction([run.cells for run in others], settings.reference_c, form)[0]
        answers.append(performance_of(name, others, soaked, made, gravity_m_s2))
    except DomainError as refusal:
        refused.append(f"{name}: could not be fitted for comparison: {refusal}")


def _run(
    recording: str,
    run: PreparedRun,
    judged: ThermalCorrection,
    plain: ThermalCorrection,
    soaked: RunSoaks,
    settings: CycleSettings,
    gravity_m_s2: float,
) -> RunFound:
    return RunFound(
        recording,
        run.series.name,
        run.series.up,
        len(run.dynamic) * run.series.sample_s,
        run.cells.force_m_s2,
        run.series.legs,
        leg_regimes(run, settings.regime.delay_s),
        float(1.0 - run.dynamic.mean()),
        trace(run, judged, plain, soaked.reference, gravity_m_s2),
    )


def _about_mean(run: PreparedRun, correction: Corrects, gravity_m_s2: float) -> float:
    errors = magnitude(run.cells, correction, gravity_m_s2).errors_m_s2
    return float(np.std(errors))


def _axis(fit: AxisFit, correction: AxisCorrection) -> AxisFound:
    still, moving = (sd if isfinite(sd) else None for sd in fit.residual_sd_m_s2)
    return AxisFound(
        correction,
        tuple(correction.standard_uncertainties().tolist()),
        (still, moving),
        fit.effective_samples,
        fit.condition,
        fit.order.bic,
        fit.order.p_value,
        fit.order.preferred,
        fit.order.reason(2),
    )


def _correlations(runs: Sequence[PreparedRun], judged: Corrects) -> tuple[AccelerometerCorrelation, ...]:
    """Correlations of outputs over K0 and of corrected forces with the case temperature, axis by axis, run by run."""
    answers: list[AccelerometerCorrelation] = []
    after = [corrected(run.cells, judged) for run in runs]
    for axis, name in enumerate(AXES):
        for run, forces in zip(runs, after, strict=True):
            before = run.cells.output_m_s2[:, axis] * judged.scales[axis]
            old, new = (
                found(run.series.name, name, correlation(v, run.cells.case(axis), run.cells.cell_s))
                for v in (before, forces[:, axis])
            )
            answers.append(AccelerometerCorrelation(old, new))
    return tuple(answers)
