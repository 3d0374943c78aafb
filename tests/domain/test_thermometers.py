"""Calibration of thermometers by cold starts: recovery within the claim, common errors, hysteresis, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from procedures.analysis.thermal.thermometers import calibrate, read_soaks
from procedures.catalog import thermometer_calibration
from procedures.catalog.thermometer_calibration import Params
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.limits import Verdict
from procedures.core.recording import MemoryRecording
from procedures.core.temperature.thermometers import SensorCorrection, ThermometerCorrection
from procedures.procedure import Context
from simulators.truth import declared_unit, default_bench, default_unit
from tests.validation.thermometer_rig import SETTINGS, compared, drawn, recordings

CONTEXT = Context(declared_unit(default_unit()), default_bench().description)


def test_offsets_and_slopes_are_within_their_claim_over_ten_units():
    """Ten numbers a unit with the claimed covariance: chi-square of 100; beyond its 1e-4 ends once in 5000 suites."""
    found = [compared(seed) for seed in range(10)]
    total = sum(float(c.error @ np.linalg.solve(c.covariance, c.error)) for c in found)
    assert chi2.ppf(1e-4, 100) < total < chi2.isf(1e-4, 100)


def test_the_place_of_the_unit_is_common_to_all_offsets_and_to_no_slope():
    with_place, without = compared(3), compared(3, replace(SETTINGS, place_sd_c=0.0))
    added = with_place.covariance - without.covariance
    offsets = np.arange(0, 10, 2)
    assert added[np.ix_(offsets, offsets)] == pytest.approx(np.full((5, 5), 0.09), rel=0.02)
    slopes = np.diag(without.covariance)[offsets + 1]
    assert np.abs(added[np.ix_(offsets + 1, offsets + 1)]).max() < 0.01 * slopes.min()


def test_corrected_readings_are_the_temperatures():
    value = ThermometerCorrection((SensorCorrection("t", 0.5, 0.01),), 20.0, ((0.04, 0.0), (0.0, 1e-6)), (-40.0, 60.0))
    assert value.corrected("t", 20.0) == pytest.approx(19.5)
    assert value.corrected("t", np.array([70.0])) == pytest.approx([69.0])
    assert value.uncertainty_c("t", 120.0) == pytest.approx(np.hypot(0.2, 0.1))
    with pytest.raises(BadParameter, match="calibrated: t"):
        value.corrected("other", 20.0)


def test_a_sensor_that_remembers_where_it_came_from_fails_and_is_named():
    """0.4 °C between the ways at one temperature, with 0.07 °C of uncertainty each: found by the test of the paths."""
    params = Params(place_sd_c=SETTINGS.place_sd_c, soak_sd_c=SETTINGS.soak_sd_c)
    given = recordings(drawn(5), 5)
    assert thermometer_calibration.analyse(given, params, CONTEXT).verdict is Verdict.PASS
    wrong = []
    for k, one in enumerate(given):
        raw = one.raw.astype(np.float64)
        raw[:, 2] += 0.4 * (k in (4, 5))
        wrong.append(MemoryRecording(one.info, raw))
    result = thermometer_calibration.analyse(wrong, params, CONTEXT)
    assert result.verdict is Verdict.FAIL
    (path,) = [c for c in result.checks if c.name.startswith("up against down")]
    assert not path.passed
    assert "temperature_gyro_x" in path.note
    planned = {p.check: p.limit for p in thermometer_calibration.planned_checks(params, CONTEXT)}
    judged = {c.name: c.limit for c in result.checks if c.name in planned}
    assert {name: limit.minimum for name, limit in planned.items()} == {n: lim.minimum for n, lim in judged.items()}


def test_the_chambers_accuracy_comes_from_the_bench_and_is_asked_for_without_it():
    params = thermometer_calibration.resolve(Params(), CONTEXT)
    assert (params.place_sd_c, params.soak_sd_c) == (0.58, 0.07)
    bare = Context(CONTEXT.unit, replace(CONTEXT.bench, chamber_accuracy=None))
    with pytest.raises(BadParameter, match=r"bench file, \[chamber\] accuracy"):
        thermometer_calibration.predict(thermometer_calibration.resolve(Params(), bare), bare)


def test_plans_that_determine_no_line_are_refused():
    with pytest.raises(BadParameter, match="none twice in a row"):
        thermometer_calibration.schedule(Params(temperatures_c=(0.0, 20.0, 20.0)))
    short = recordings(drawn(1), 1, targets=(0.0, 20.0))
    with pytest.raises(UnfitRecording, match="3 temperatures at least"):
        calibrate(read_soaks(short, SETTINGS), SETTINGS)


def test_a_short_soak_is_said_and_widens_the_claim():
    params = thermometer_calibration.resolve(Params(soak_s=6000.0), CONTEXT)
    predicted = thermometer_calibration.predict(params, CONTEXT)
    assert "leaves up to" in predicted.warnings[0]
    long = thermometer_calibration.predict(thermometer_calibration.resolve(Params(), CONTEXT), CONTEXT)
    assert not long.warnings
    assert predicted.uncertainties[1].standard_uncertainty > 2.0 * long.uncertainties[1].standard_uncertainty


def test_a_sensor_that_is_stuck_or_gone_is_named():
    given = recordings(drawn(2), 2)
    for column, value, words in ((3, 21.0, "temperature_gyro_y went by 0.00"), (1, -32768.0, "converter was disc")):
        wrong = []
        for one in given:
            raw = one.raw.astype(np.float64)
            raw[:, column] = value
            wrong.append(MemoryRecording(one.info, raw))
        with pytest.raises(UnfitRecording, match=words):
            read_soaks(wrong, SETTINGS)
