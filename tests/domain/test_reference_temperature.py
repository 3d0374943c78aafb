"""A calibration with a thermal correction: what it finds of a warm unit is what the unit is at the reference.

The data come from the simulator's own thermal behaviour, in which nothing of the correction's algebra is written.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from procedures import methods
from procedures.analysis.calibration.reference_temperature import gyros_at_reference
from procedures.analysis.calibration.station_means import station_means
from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.calibration.triad_analysis import AccelerometerSettings, analyse_accelerometers
from procedures.catalog.calibration_12_orientations import PROCEDURE, Params, schedule
from procedures.core.converter import ConverterModel, Normalised
from procedures.core.errors import BadParameter, MissingChannel, UnfitRecording
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.core.temperature.gyros import GyroPolynomial, GyroThermalCorrection
from procedures.core.temperature.thermometers import SensorCorrection, ThermometerCorrection
from procedures.core.thermal_correction import AxisCorrection, Form, TemperatureRange, ThermalCorrection
from procedures.core.unit import TriadRecord, Unit
from procedures.procedure import Evidence
from simulators.chamber.behaviour import response
from simulators.truth.thermal import REFERENCE_C, AccelerometerThermalTruth, ConverterTruth, UnitThermalTruth
from tests.kit.forward_model import ACCELEROMETER_NOISE, B_ACCELEROMETER, K_ACCELEROMETER, SITE, Table

LAG_S = 5.0
OFFSET_C = (0.4, -0.3)
STEP_C, NOISE_C = 0.0625, 0.03
RECORD = TriadRecord((ACCELEROMETER_NOISE,) * 3)
STATIONS = schedule(Params.model_validate({"dwell_s": 70.0, "thermal_correction": "current"}))
SPREAD = np.array([1e-9, 4e-8, 1e-9, 4e-8, 8e-7, 2e-8, 8e-7, 2e-8])
"""Standard uncertainties of α1 … α4, β1 … β4 as a thermal cycle leaves them, somewhat worse."""
STILL = UnitThermalTruth(converter=(ConverterTruth(scale_drift=(0.0, 0.0), zero_drift=(0.0, 0.0)),) * 3)
"""A unit whose converter does not drift: nothing for a first stage."""
CHANNELS = (
    *(Channel(name, Quantity.SPECIFIC_FORCE, "m/s^2") for name in ACCELEROMETER),
    *(Channel(f"temperature_{n}", Quantity.TEMPERATURE, "degC", STEP_C) for n in ("case", "converter")),
)


def warm_up(seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Case and converter some minutes after power-up in a warm chamber [°C]."""
    return 34.0 + 4.0 * (1 - np.exp(-seconds / 900)), 33.0 + 9.0 * (1 - np.exp(-seconds / 1500))


def lagged(temperature: np.ndarray) -> np.ndarray:
    """A first-order lag of `LAG_S` in steps of a tenth of a second."""
    value, out = temperature[0], []
    for t in np.repeat(temperature, 10):
        value += 0.1 / LAG_S * (t - value)
        out.append(value)
    return np.array(out)[9::10]


def recordings(truth: UnitThermalTruth, rng: np.random.Generator, bias: np.ndarray) -> list[MemoryRecording]:
    """Twelve dwells of 70 s at 1 Hz, 10 s apart, the unit warming all the while."""
    times = np.arange(12 * 80.0) + 60.0
    case, board = warm_up(times)
    nodes = np.repeat(case[:, None], 8, axis=1)
    nodes[:, 3] = board
    felt = response(truth, nodes)
    codes = [
        np.rint((lagged(t) + offset + NOISE_C * rng.standard_normal(len(t))) / STEP_C)
        for t, offset in zip((case, board), OFFSET_C, strict=True)
    ]
    windows = np.array([[80.0 * i, 80.0 * i + 70.0] for i in range(12)])
    covariance = triad_covariance(RECORD, windows)
    assert covariance is not None
    drawn = np.column_stack([np.linalg.cholesky(c) @ rng.standard_normal(12) for c in covariance])
    made = []
    for i, station in enumerate(STATIONS):
        span = slice(80 * i, 80 * i + 70)
        through = K_ACCELEROMETER @ Table().vectors(station, SITE)[1]
        output = felt.accelerometer_output(bias, through)[span] + drawn[i]
        output = output + 1e-7 * np.where(np.arange(70) % 2, 1.0, -1.0)[:, None]
        raw = np.column_stack([output, *(c[span] for c in codes)])
        info = RecordingInfo(f"r{i}", "S-1", CHANNELS, 1.0, 70, 80.0 * i, station)
        made.append(MemoryRecording(info, raw))
    return made


def true_correction(truth: UnitThermalTruth, form: Form = Form.BOTH) -> ThermalCorrection:
    """The truth as a correction; B0 and K0 of another launch."""
    axes = []
    for i, a in enumerate(truth.accelerometers):
        scale = 1.0 / (K_ACCELEROMETER[i, i] * (1 + 8e-5))
        alpha = scale * np.array([a.scale_static[1], a.scale_static[0], a.scale_dynamic[1], a.scale_dynamic[0]])
        references = (REFERENCE_C + OFFSET_C[0], REFERENCE_C + OFFSET_C[1])
        covariance = tuple(tuple(row) for row in np.diag(SPREAD**2).tolist())
        beta = (*a.bias_static, *a.bias_dynamic)
        b0 = -float(B_ACCELEROMETER[i]) + 5e-5
        axes.append(AxisCorrection(scale, b0, tuple(alpha.tolist()), beta, *references, form, covariance=covariance))
    seen = TemperatureRange((-40.0, 60.0), (-40.0, 60.0))
    return ThermalCorrection("accelerometer", (axes[0], axes[1], axes[2]), fitted_range=seen)


def drawn_correction(truth: UnitThermalTruth, rng: np.random.Generator) -> ThermalCorrection:
    """As a thermal cycle would find it: off by its own standard uncertainties."""
    right = true_correction(truth)
    axes = []
    for axis in right.axes:
        off = np.array([*axis.alpha, *axis.beta]) + SPREAD * rng.standard_normal(8)
        axes.append(replace(axis, alpha=tuple(off[:4].tolist()), beta=tuple(off[4:].tolist())))
    return replace(right, axes=(axes[0], axes[1], axes[2]))


def calibrated(data: list[MemoryRecording], correction: ThermalCorrection | None):
    settings = AccelerometerSettings(False, "noise_and_table", correction, (LAG_S, LAG_S))
    summary, _, share, doubts = analyse_accelerometers(data, SITE, TableUncertainty(), RECORD, settings)
    return summary, share, doubts


def errors(summary, bias: np.ndarray) -> np.ndarray:
    return summary.calibration.coefficients - np.column_stack([bias, K_ACCELEROMETER]).ravel()


def test_a_warm_unit_is_found_as_it_is_at_the_reference_within_what_is_claimed():
    """Thirty units with noise, an inexact correction and noisy sensors: errors have the covariance that is claimed."""
    total, degrees = 0.0, 0
    for seed in range(30):
        rng = np.random.Generator(np.random.PCG64(seed))
        bias = B_ACCELEROMETER + 5e-5 * rng.standard_normal(3)
        data = recordings(STILL, rng, bias)
        summary, share, warnings = calibrated(data, drawn_correction(STILL, rng))
        off = errors(summary, bias)
        total += float(off @ np.linalg.solve(summary.calibration.covariance_array, off))
        degrees += 12
        assert warnings == ()
        assert share is not None
        assert share.form is Form.BOTH
    assert chi2.ppf(3e-5, degrees) < total < chi2.isf(3e-5, degrees)  # 4 standard deviations of a normal number


def test_recordings_without_a_bench_are_brought_to_the_reference_by_the_units_correction():
    """The method on recordings gives what the calibration on the bench gives, and says where it extrapolates."""
    rng = np.random.Generator(np.random.PCG64(78))
    data, correction = recordings(STILL, rng, B_ACCELEROMETER), true_correction(STILL)
    unit = Unit("S-1", 1.0, CHANNELS, accelerometer=RECORD, thermal_correction=correction, thermal_correction_id="c")
    method = methods.discover()["multi_position_calibration_of_recordings"]
    given = {"gravity_m_s2": SITE.gravity_m_s2, "gravity_sd_m_s2": 0.0, "triads": ["accelerometer"]}
    given |= {"case_lag_s": LAG_S, "converter_lag_s": LAG_S, "thermal_correction": "current"}
    params = method.params.model_validate(given)
    found = method.analyse(Evidence(tuple(data)), params, unit)
    expected, share, _ = calibrated(data, correction)
    np.testing.assert_allclose(found.triads[0].calibration.coefficients, expected.calibration.coefficients, rtol=1e-9)
    np.testing.assert_allclose(
        found.triads[0].calibration.standard_uncertainties, expected.calibration.standard_uncertainties, rtol=1e-6
    )
    assert found.thermal == share
    applied = (
        "Accelerometer outputs brought to the reference temperatures",
        "What the thermal correction leaves uncertain",
    )
    assert set(applied) <= {s.title for s in method.report(found).sections}
    assert method.uses_corrections(found) == ("thermal",), "no gyros were calibrated"
    plain = method.analyse(Evidence(tuple(data)), params.model_copy(update={"thermal_correction": "none"}), unit)
    assert method.uses_corrections(plain) == ()
    assert set(applied).isdisjoint(s.title for s in method.report(plain).sections)
    cold = replace(correction, fitted_range=TemperatureRange((-40.0, 30.0), (-40.0, 30.0)))
    beyond = method.analyse(Evidence(tuple(data)), params, replace(unit, thermal_correction=cold))
    assert any("beyond the range" in w for w in beyond.warnings)
    with pytest.raises(BadParameter, match="has no current thermal correction"):
        method.analyse(Evidence(tuple(data)), params, replace(unit, thermal_correction=None))
    with pytest.raises(BadParameter, match="needs the recordings' unit"):
        method.analyse(Evidence(tuple(data)), params, None)
    short = [MemoryRecording(replace(r.info, count=9), r.raw[:9]) for r in data]
    with pytest.raises(UnfitRecording, match="lasts 9 s: thermal_correction=current needs at least 10 s"):
        method.analyse(Evidence(tuple(short)), params, unit)


def test_without_the_correction_it_is_wrong_by_many_standard_uncertainties():
    rng = np.random.Generator(np.random.PCG64(77))
    data = recordings(STILL, rng, B_ACCELEROMETER)
    plain = calibrated(data, None)[0]
    off = np.abs(errors(plain, B_ACCELEROMETER)) / plain.calibration.standard_uncertainties
    assert np.all(off[::4] > 100)  # the biases: some 0.01 m/s²
    corrected, share, _ = calibrated(data, true_correction(STILL))
    sd = corrected.calibration.standard_uncertainties
    assert np.all(np.abs(errors(corrected, B_ACCELEROMETER)) < 4 * sd)
    assert share is not None
    for name, part in zip(share.from_correction, sd, strict=True):
        assert 0.0 < np.hypot(share.from_correction[name], share.from_sensors[name]) < part
    before, after = plain.p_value, corrected.p_value
    assert before is not None
    assert after is not None
    assert before < 1e-6 < 0.001 < after


def test_the_converters_first_stage_belongs_to_the_correction():
    """A drifting converter: the correction's own models take it out; a correction that lacks them is wrong."""
    truth = UnitThermalTruth()
    rng = np.random.Generator(np.random.PCG64(5))
    data = recordings(truth, rng, B_ACCELEROMETER)
    models = []
    for c in truth.converter:
        none = tuple(tuple(row) for row in np.zeros((3, 3)).tolist())
        reference = REFERENCE_C + OFFSET_C[1]
        scale = Normalised(True, reference, c.codes_a_ma, c.scale_drift, none, 0.0)
        models.append(ConverterModel(scale, Normalised(False, reference, c.zero_code, c.zero_drift, none, 0.0)))
    right = replace(true_correction(truth), first_stage=(models[0], models[1], models[2]))
    summary = calibrated(data, right)[0]
    sd = summary.calibration.standard_uncertainties
    assert np.all(np.abs(errors(summary, B_ACCELEROMETER)) < 4 * sd)
    without = calibrated(data, true_correction(truth))[0]
    assert np.max(np.abs(errors(without, B_ACCELEROMETER)) / sd) > 10


def test_the_switched_form_is_static_and_says_so():
    """Truth with terms of the case alone is what the static regime of thesis 3.19 describes."""
    still = [AccelerometerThermalTruth(a.scale_static, (0.0, 0.0), a.bias_static) for a in STILL.accelerometers]
    truth = replace(STILL, accelerometers=(still[0], still[1], still[2]))
    data = recordings(truth, np.random.Generator(np.random.PCG64(6)), B_ACCELEROMETER)
    summary, share, warnings = calibrated(data, true_correction(truth, Form.SWITCHED))
    assert np.all(np.abs(errors(summary, B_ACCELEROMETER)) < 4 * summary.calibration.standard_uncertainties)
    assert share is not None
    assert share.regime == "static"
    # 4·exp(−t/900)/900 °C/s falls below 0.15 °C/min at t = 518 s: six of the dwells' middles come before.
    assert [w for w in warnings if "at 6 stations" in w] == list(warnings) != []


def test_a_correction_without_covariance_is_used_but_said():
    data = recordings(STILL, np.random.Generator(np.random.PCG64(8)), B_ACCELEROMETER)
    bare = true_correction(STILL)
    axes = tuple(replace(axis, covariance=()) for axis in bare.axes)
    _, share, warnings = calibrated(data, replace(bare, axes=(axes[0], axes[1], axes[2])))
    assert share is not None
    assert set(share.from_correction.values()) == {0.0}
    assert len(warnings) == 1
    assert "no covariance" in warnings[0]


def test_what_is_refused():
    data = recordings(STILL, np.random.Generator(np.random.PCG64(9)), B_ACCELEROMETER)
    cold = [MemoryRecording(replace(r.info, channels=CHANNELS[:3]), r.raw[:, :3]) for r in data]
    with pytest.raises(MissingChannel, match="temperature_case"):
        calibrated(cold, true_correction(STILL))
    short = [MemoryRecording(replace(r.info, rate_hz=25.0), r.raw) for r in data]
    with pytest.raises(BadParameter, match="dwell_s"):
        calibrated(short, true_correction(STILL))


def test_stations_ask_for_temperatures_only_with_a_correction():
    assert all(s.temperatures for s in STATIONS)
    assert not any(s.temperatures for s in schedule(Params.model_validate({"dwell_s": 70.0})))
    assert PROCEDURE.uses_corrections(Params.model_validate({"thermal_correction": "current"})) == ("thermal", "gyros")
    assert PROCEDURE.uses_corrections(Params.model_validate({})) == ()


def test_a_gyro_that_depends_on_temperature_is_brought_to_its_reference():
    """Rates of 1e-7 rad/s/°C over a thermometer that reads 2 °C too much: nothing of it is left, its doubt is told."""
    names = tuple(f"temperature_gyro_{axis}" for axis in "xyz")
    sensors = ThermometerCorrection(
        tuple(SensorCorrection(n, 2.0, 0.0) for n in names), 20.0, tuple(map(tuple, np.zeros((6, 6)))), (0.0, 60.0)
    )
    curve = GyroPolynomial((1e-7,), ((4e-18,),))
    correction = GyroThermalCorrection((curve, GyroPolynomial(), GyroPolynomial()), 20.0, (0.0, 60.0), sensors)
    channels = (
        *(Channel(n, Quantity.ANGULAR_RATE, "rad/s") for n in GYRO),
        *(Channel(n, Quantity.TEMPERATURE, "degC") for n in names),
    )
    given = []
    for k, temperature in enumerate((20.0, 40.0, 60.0)):
        ripple = 1e-9 * np.where(np.arange(70) % 2, 1.0, -1.0)
        rates = [5e-5 + 1e-7 * (temperature - 20.0) + ripple, 1e-5 + ripple, ripple]
        raw = np.column_stack([*rates, *(np.full(70, temperature + 2.0) + ripple for _ in names)])
        given.append(MemoryRecording(RecordingInfo(f"r{k}", "S-1", channels, 1.0, 70, 80.0 * k, STATIONS[k]), raw))
    means, covariance = gyros_at_reference(given, station_means(given, "gyro"), correction)
    assert means.outputs[:, 0] == pytest.approx([5e-5] * 3, rel=1e-9)
    assert means.outputs[:, 1] == pytest.approx([1e-5] * 3, rel=1e-9)
    assert np.sqrt(np.diagonal(covariance[0])) == pytest.approx([0.0, 2e-9 * 20, 2e-9 * 40], abs=1e-15)
    assert covariance[0, 1, 2] == pytest.approx(4e-18 * 20 * 40)
    assert not covariance[1:].any()
