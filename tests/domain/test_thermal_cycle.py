"""The procedure `thermal_cycle` on runs of the validation's rig: recovery, another cycle, gyros, refusals."""

from dataclasses import replace

import numpy as np
import pytest

from bench_service.model.quantities import quantities
from procedures.analysis.thermal.cycle.checks import cycle_checks
from procedures.bench.description import AxisLimits, BenchDescription, TableAccuracy
from procedures.catalog import thermal_cycle
from procedures.catalog.thermal_cycle import Params, Result
from procedures.core.errors import BadParameter, DomainError, UnfitRecording
from procedures.core.limits import ASKED, Verdict
from procedures.core.recording import MemoryRecording
from procedures.core.report import Figure, Table
from procedures.procedure import Context
from simulators.truth.thermal import GyroThermalTruth, UnitThermalTruth
from tests.domain.thermal_samples import SENSORS, SITE, recordings, unit_of
from tests.validation.thermal_population import AFTER, BEFORE, FAULT
from tests.validation.thermal_rig import LAG_S, OTHER, THESIS_LIKE, cycle, reference_c, true_coefficients

TRUTH = UnitThermalTruth()
CASE_C, CONVERTER_C = reference_c(TRUTH)
PARAMS = Params(
    reference_case_c=CASE_C, reference_converter_c=CONVERTER_C, case_lag_s=LAG_S, converter_lag_s=LAG_S, lag_sd_s=0.0
)


@pytest.fixture(scope="module")
def known() -> Context:
    axis = AxisLimits(-360.0, 360.0, 60.0, 60.0)
    bench = BenchDescription("bench-1", SITE, axis, axis, axis, TableAccuracy(), simulated=True)
    return Context(unit_of(TRUTH, 5), bench)


@pytest.fixture(scope="module")
def runs() -> list[MemoryRecording]:
    return recordings(TRUTH, THESIS_LIKE, 5)


@pytest.fixture(scope="module")
def result(known: Context, runs: list[MemoryRecording]) -> Result:
    return thermal_cycle.analyse(runs, PARAMS, known)


@pytest.fixture(scope="module")
def held_out(known: Context, result: Result) -> Result:
    """The same unit through another profile with other seeds, judged by the correction of the first cycle."""
    (correction,) = thermal_cycle.corrections(result)
    unit = replace(known.unit, thermal_correction=correction.thermal, thermal_correction_id="c-1")
    truth = replace(TRUTH, gyro=GyroThermalTruth((FAULT, 0.0, 0.0)))
    later = Context(unit, known.bench)
    return thermal_cycle.analyse(
        recordings(truth, OTHER, 6), PARAMS.model_copy(update={"correction": "current"}), later
    )


def test_a_sound_unit_passes_and_its_result_survives_storage(result: Result):
    assert result.verdict is Verdict.PASS, [c for c in result.checks if not c.passed]
    assert Result.model_validate_json(result.model_dump_json()) == result
    assert len(result.model_dump_json()) < 2_000_000
    assert result.cycle.stage_one
    assert result.cycle.force_known


def test_the_limits_are_known_beforehand(result: Result, known: Context):
    planned = {one.check: one.limit for one in thermal_cycle.PROCEDURE.planned_checks(PARAMS, known)}
    assert planned == {c.name: c.limit for c in result.checks}
    promised = thermal_cycle.PROCEDURE.quantities
    assert promised is not None
    assert set(promised(PARAMS, known)) == set(quantities(result.model_dump(mode="json"))), "every name, and no other"


def test_a_limit_that_was_given_has_the_request_for_its_source(result: Result):
    """The same cycle is held to other limits; the thesis stands beside its own numbers alone."""
    limits = thermal_cycle.Limits(three_sigma_m_s2=0.001, gyro_bias_in_run_deg_h=0.02)
    given = thermal_cycle._limits(PARAMS.model_copy(update={"limits": limits, "level": 0.02}))
    sources = {c.name: c.limit.source for c in cycle_checks(result.cycle, given)}
    default = {c.name: c.limit.source for c in result.checks}
    asked = ("3σ after correction", "bias instability in the cycle", "independence of temperature, p-value")
    for name, source in sources.items():
        assert source == (ASKED if name.endswith(asked) else default[name]), name
        assert default[name].startswith("thesis")


def test_all_coefficients_are_the_truth_within_their_uncertainties(result: Result):
    """24 numbers of unit spread, a fixed seed: beyond four once in six hundred sets."""
    estimates = np.array([[*a.correction.alpha, *a.correction.beta] for a in result.cycle.axes])
    claimed = np.array([a.uncertainties for a in result.cycle.axes])
    z = (estimates - true_coefficients(TRUTH)) / claimed
    assert np.abs(z).max() < 4.0, z


def test_the_forces_felt_are_found_through_the_calibration(result: Result, runs: list[MemoryRecording]):
    """The rig's seat leans by milliradians; the launch adds 5.3e-5 m/s² and 80 ppm of its own, taken four times."""
    for run in result.cycle.runs:
        true = np.array(cycle(TRUTH, THESIS_LIKE[:1], run.up, 50 + run.up).force)
        allowed = 4.0 * np.hypot(5.3e-5 / 0.81, 80e-6 * true)
        assert np.all(np.abs(np.array(run.force_m_s2) - true) < allowed)


def test_3_sigma_on_a_cycle_that_was_not_fitted_is_within_table_4_5(held_out: Result):
    assert held_out.cycle.judged == "current"
    assert thermal_cycle.corrections(held_out) == ()
    for target, allowed in AFTER.items():
        (soak,) = [s for s in held_out.cycle.soaks if s.target_c == target]
        assert soak.runs == 3
        assert np.all(np.array(soak.after_m_s2) <= allowed), soak
        # "Before" of the default truth is made from the same table, at nodes 40 °C from the reference; here the case
        # is 3.5 °C warmer and falls short of its soak: a fifth.
        assert np.array(soak.before_m_s2) == pytest.approx(np.array(BEFORE[target]), rel=0.25)


def test_two_sensors_beat_one_polynomial_on_ramps(result: Result, held_out: Result):
    for found in (result, held_out):
        of = {f.form: f.magnitude_dynamic_m_s2 for f in found.cycle.forms}
        assert set(of) >= {"both", "switched", "single", "normalised polynomial (C)"}
        assert min(of["switched"], of["single"], of["normalised polynomial (C)"]) > 10.0 * of["both"]


def test_the_second_order_is_justified(result: Result):
    for axis in result.cycle.axes:
        assert axis.preferred_order == 2
        assert axis.p_values[0] < 1e-6
        assert axis.p_values[1] > 1e-4


def test_regimes_follow_the_ramps_within_the_delay_and_do_not_chatter(result: Result):
    for run in result.cycle.runs:
        for leg, regime in zip(run.legs, run.regimes, strict=True):
            assert regime.chatter == 0
            if regime.onset_delay_s is not None:
                assert 0.0 < regime.onset_delay_s <= result.cycle.regime_delay_s
            assert regime.ramp_began_s in (None, leg.began_s)
        assert sum(r.onset_delay_s is not None for r in run.regimes) >= 5


def test_every_output_goes_with_temperature_before_and_none_after(result: Result):
    level = 0.001 / 9.0
    for c in result.cycle.accelerometers:
        assert c.before.p_value < level
        assert abs(c.after.slope) < 4.0 * c.after.slope_sd
        assert c.after.p_value > level


def test_a_gyro_whose_perimeter_control_fails_is_found_and_named(result: Result, held_out: Result):
    assert [c.name for c in held_out.checks if not c.passed] == ["gyro_x independence of temperature, p-value"]
    (x,) = [g for g in held_out.cycle.gyros if g.axis == "x"]
    assert abs(x.slope_rad_s_c - FAULT) < 4.0 * x.slope_sd_rad_s_c
    assert all(g.p_value > 0.01 / 3.0 for g in result.cycle.gyros)


def test_the_report_is_complete_and_small_enough_to_draw(result: Result):
    sections = thermal_cycle.report(result).sections
    tables = [s for s in sections if isinstance(s, Table)]
    figures = [s for s in sections if isinstance(s, Figure)]
    assert len(tables) == 11
    assert len(figures) == 3 * 5 + 3 + 1
    for table in tables:
        assert all(len(row) == len(table.columns) for row in table.rows), table.title
    for figure in figures:
        for series in figure.series:
            assert len(series.x) == len(series.y) <= 1500
            assert np.all(np.isfinite([*series.x, *series.y, *series.upper]))


def test_what_is_missing_is_said(runs: list[MemoryRecording], known: Context):
    bare = Context(replace(known.unit, converter=None, calibrations=(), gyro=None), known.bench)
    warnings = " ".join(thermal_cycle.predict(PARAMS, bare).warnings)
    assert "converter" in warnings
    assert "calibration" in warnings
    with pytest.raises(BadParameter, match="no current thermal correction"):
        thermal_cycle.predict(PARAMS.model_copy(update={"correction": "current"}), bare)
    with pytest.raises(BadParameter, match="no current thermal correction"):
        thermal_cycle.analyse(runs, PARAMS.model_copy(update={"correction": "current"}), bare)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        ("disconnected", f"{SENSORS[2]} was disconnected"),
        ("short", "ends after 7 of 8 legs"),
        ("counts", "accelerometer_y is in count"),
        ("no profile", "is not a run of a thermal cycle"),
        ("twice", "with axis y up at least once"),
    ],
)
def test_runs_that_cannot_be_judged_are_refused(spoil: str, said: str, runs: list[MemoryRecording], known: Context):
    x, y, z = runs
    raw, info = y.raw, y.info
    if spoil == "disconnected":
        raw = raw.copy()
        raw[40_000, 8] = -32768
    elif spoil == "short":
        raw = raw[:40_000]
        info = replace(info, count=40_000)
    elif spoil == "counts":
        channels = list(info.channels)
        channels[4] = replace(channels[4], unit="count")
        info = replace(info, channels=tuple(channels))
    elif spoil == "no profile":
        assert info.station is not None
        info = replace(info, station=replace(info.station, profile=None))
    given = [x, x, z] if spoil == "twice" else [x, MemoryRecording(info, raw), z]
    with pytest.raises(DomainError, match=said) as refusal:
        thermal_cycle.analyse(given, PARAMS, known)
    assert isinstance(refusal.value, (UnfitRecording, BadParameter))
