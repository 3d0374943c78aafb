"""Sensors in a thermal cycle: calibrated thermometers, the converter's delay, the gyros' own; hysteresis; gyros."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.analysis.thermal.cycle.checks import CycleLimits, cycle_checks
from procedures.analysis.thermal.following import follow, modelled
from procedures.bench.description import AxisLimits, BenchDescription, TableAccuracy
from procedures.catalog import thermal_cycle
from procedures.catalog.thermal_cycle import Params, Result
from procedures.core import units
from procedures.core.errors import UnfitRecording
from procedures.core.noise import NoiseCoefficients
from procedures.core.temperature.thermometers import SensorCorrection, ThermometerCorrection
from procedures.core.unit import TriadRecord
from procedures.procedure import Context
from simulators.truth.thermal import REFERENCE_C, GyroThermalTruth, UnitThermalTruth
from tests.domain.thermal_samples import SENSORS, SITE, recordings, unit_of
from tests.validation.thermal_rig import FLICKER, LAG_S, QUANTIZATION, profile, reference_c, true_coefficients

LEGS = profile((20.0, 60.0, 20.0, -20.0, 20.0), 2.0, 7.5)
"""20 °C is reached from above and from below."""
BASE = UnitThermalTruth()
CONVERTER_LAG_S = 8.0
TRUTH = replace(
    BASE,
    gyro=GyroThermalTruth((3e-3 * units.DEG_PER_HOUR, 0.0, 0.0)),
    thermometers=tuple(
        replace(t, slope=0.004 * (i - 2), lag_s=CONVERTER_LAG_S if i == 1 else LAG_S)
        for i, t in enumerate(BASE.thermometers)
    ),
)
KNOWN = ThermometerCorrection(
    tuple(
        SensorCorrection(name, t.offset_c / (1.0 + t.slope), t.slope / (1.0 + t.slope))
        for name, t in zip(SENSORS, TRUTH.thermometers, strict=True)
    ),
    REFERENCE_C,
    tuple(tuple(row) for row in np.diag([0.01**2, 1e-5**2] * 5).tolist()),
    (-40.0, 60.0),
)
PARAMS = Params(case_lag_s=LAG_S, lag_sd_s=0.05)


@pytest.fixture(scope="module")
def known() -> Context:
    axis = AxisLimits(-360.0, 360.0, 60.0, 60.0)
    bench = BenchDescription("bench-1", SITE, axis, axis, axis, TableAccuracy(), simulated=True)
    # Stage one refers to a reading of the converter's sensor: the rig's, at the node's reference.
    noise = NoiseCoefficients(quantization=QUANTIZATION, bias_instability=FLICKER)
    record = TriadRecord((noise, noise, noise))
    unit = replace(unit_of(BASE, 5), accelerometer=record, thermometers=KNOWN, thermometers_id="t-1")
    return Context(unit, bench)


@pytest.fixture(scope="module")
def runs():
    return recordings(TRUTH, LEGS, 5)


@pytest.fixture(scope="module")
def result(known: Context, runs) -> Result:
    return thermal_cycle.analyse(runs, PARAMS.model_copy(update={"gyro_dependence": "correct"}), known)


def test_the_converters_lag_is_found_and_used(result: Result):
    """Four claimed standard uncertainties; the case's own time constant is off by nothing here."""
    found = result.cycle.following
    assert found is not None
    assert abs(found.sensor_lag_s - CONVERTER_LAG_S) < 4.0 * found.sensor_lag_sd_s
    true = TRUTH.network.converter_j_k / TRUTH.network.case_to_converter_w_k
    assert abs(found.delay_s - true) < 4.0 * max(found.delay_sd_s, 0.05)
    assert abs(found.total_delay_s - (true + CONVERTER_LAG_S - LAG_S)) < 4.0 * max(found.total_delay_sd_s, 0.05)
    assert result.cycle.converter_lag_s == found.sensor_lag_s


def test_a_cycle_by_calibrated_thermometers_gives_coefficients_of_temperature(result: Result, known: Context, runs):
    """Readings that are 0.8 % steep make slopes that are 0.8 % flat: three numbers are then many uncertainties off."""
    assert result.cycle.thermometers
    assert result.cycle.correction.thermometers == KNOWN

    def worst(cycle) -> float:
        found = np.array([[*a.correction.alpha, *a.correction.beta] for a in cycle.axes])
        return float(np.abs((found - true_coefficients(TRUTH)) / [a.uncertainties for a in cycle.axes]).max())

    assert worst(result.cycle) < 4.5
    case, converter = reference_c(TRUTH)
    at = {"thermometers": "none", "reference_case_c": case, "reference_converter_c": converter}
    without = thermal_cycle.analyse(runs, PARAMS.model_copy(update=at), known)
    assert not without.cycle.thermometers
    assert worst(without.cycle) > 6.0


def test_the_thesiss_own_regressor_stands_beside_ours(result: Result, known: Context, runs):
    """The truth acts at the case: the gyros' thermometers lag twenty minutes behind it, and leave more on ramps."""
    of = {f.form: f.magnitude_dynamic_m_s2 for f in result.cycle.forms}
    beside = of["thesis 4.1, each axis by its own gyro's thermometer"]
    assert beside > 3.0 * of["both"]
    chosen = thermal_cycle.analyse(runs, PARAMS.model_copy(update={"static_sensor": "gyros"}), known)
    swapped = {f.form: f.magnitude_dynamic_m_s2 for f in chosen.cycle.forms}
    assert chosen.cycle.correction.static_sensors == "gyros"
    # The forces rest on a first fit with the chosen sensors, and so differ a little.
    assert swapped["both"] == pytest.approx(beside, rel=0.02)
    assert swapped["all axes by the case's thermometer"] < 0.1 * beside


def test_hysteresis_is_told_with_an_uncertainty_and_found_where_it_is(result: Result, known: Context, runs):
    sound = result.cycle.hysteresis
    assert len(sound) == 9
    assert {h.target_c for h in sound} == {20.0}
    z = np.array([h.difference_m_s2 / h.standard_uncertainty_m_s2 for h in sound])
    assert np.abs(z).max() < 4.5  # nine of unit spread: once in 15 000 suites
    # An accelerometer that remembers: 3e-4 m/s² more after the cold than after the heat, from half way of the cycle.
    wrong = []
    for one in runs:
        raw = one.raw.copy()
        raw[len(raw) * 7 // 10 :, 4] += 3e-4
        wrong.append(replace(one, raw=raw))
    found = thermal_cycle.analyse(wrong, PARAMS, known).cycle.hysteresis
    assert min(h.p_value for h in found if h.axis == "y") < 1e-6


def test_a_gyro_that_depends_is_corrected_and_judged_on_runs_it_has_not_seen(result: Result):
    (corrected,) = result.cycle.gyros_corrected
    assert corrected.axis == "x"
    assert corrected.order == 1
    assert corrected.reason.startswith("order 1: the criterion is least there")
    assert corrected.p_before < 1e-6
    assert corrected.p_after is not None
    assert corrected.p_after > 1e-3
    gyros = result.cycle.gyro_correction
    assert gyros is not None
    (slope,) = gyros.gyros[0].coefficients
    sd = np.sqrt(gyros.gyros[0].covariance[0][0])
    # By the gyro's own thermometer, calibrated: the node's temperature but for its lag.
    assert abs(slope - 3e-3 * units.DEG_PER_HOUR) < 4.0 * sd
    assert gyros.gyros[1].coefficients == ()
    assert [c.kind for c in thermal_cycle.corrections(result)] == ["thermal", "gyros"]
    names = {c.name: c for c in result.checks}
    assert names["gyro_x independence of temperature, p-value"].passed
    limits = CycleLimits(1.0, 1.0, 1.0, 1.0, 1.0, 0.01)
    failing = {c.name: c for c in cycle_checks(result.cycle, limits)}
    assert not failing["gyro_x independence of temperature, p-value"].passed


def test_orders_one_to_five_are_tested_and_the_reason_is_printed(result: Result):
    for axis in result.cycle.axes:
        assert len(axis.bic) == 5
        assert len(axis.p_values) == 4
        assert axis.preferred_order == 2
        assert axis.order_reason.startswith("order 2: the criterion is least there")
    report = thermal_cycle.report(result)
    (table,) = [s for s in report.sections if s.title.startswith("Choice of the order")]
    assert "F tests: 2 against 1" in table.note


def test_a_board_that_does_not_follow_the_case_is_said_and_not_used():
    rng = np.random.Generator(np.random.PCG64(1))
    case = np.interp(np.arange(20_000.0), [0, 4000, 8000, 14_000, 20_000], [20.0, 60.0, 60.0, -20.0, -20.0])
    reading = case + 0.03 * rng.standard_normal(len(case))
    board = modelled(case, 1.0, 600.0, 5.0, 5.0) + 2.0 + 0.03 * rng.standard_normal(len(case))
    assert follow([reading], [board], 1.0).p_value > 1e-3
    half = 0.5 * (board + modelled(case, 1.0, 3000.0, 5.0, 5.0))
    assert follow([reading], [half], 1.0).p_value < 1e-6
    with pytest.raises(UnfitRecording, match="less than 5 °C"):
        follow([np.full(5000, 20.0)], [board[:5000]], 1.0)
