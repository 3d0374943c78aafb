"""The regime indicator against closed forms of its filter, and what a threshold with hysteresis must do."""

import numpy as np
import pytest
from scipy.signal import lfilter

from procedures.analysis.thermal.regime import RegimeIndicator, RegimeSettings, regimes
from procedures.core.errors import BadParameter, UnfitRecording
from tests.validation.thermal_rig import switches

SETTINGS = RegimeSettings()


def test_a_parabola_is_followed_exactly() -> None:
    t = np.arange(6000.0)
    trace = regimes(15.0 + 2e-3 * t + 4e-6 * t**2, 1.0)
    # The start, level and without slope, dies out as x²·e^−x; at x = 50 it is below rounding.
    assert trace.acceleration_c_s2[-1] == pytest.approx(8e-6, rel=1e-6)
    assert trace.rate_c_s[-1] == pytest.approx(2e-3 + 8e-6 * t[-1], rel=1e-6)


def test_the_second_derivative_is_the_second_difference_behind_three_equal_lags() -> None:
    temperature = 20.0 + np.cumsum(np.cumsum(np.random.default_rng(1).normal(0.0, 1e-4, 3000)))
    temperature[:3] = temperature[0]  # the filter starts level
    theta = np.exp(-1.0 / SETTINGS.memory_s)
    expected = np.diff(temperature, 2, prepend=[temperature[0]] * 2)
    for _ in range(3):
        expected = lfilter([1.0 - theta], [1.0, -theta], expected)
    found = regimes(temperature, 1.0).acceleration_c_s2
    # Double poles at a level of 20 and a second difference of 1e-4: rounding of 1e-15·20 grows by memory².
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max() + 1e-10)


def test_the_live_indicator_and_the_record_agree_to_the_last_bit() -> None:
    temperature = 20.0 + np.random.default_rng(2).normal(0.0, 0.03, 2000).cumsum()
    indicator = RegimeIndicator(1.0)
    live = [indicator.step(float(t)) for t in temperature]
    trace = regimes(temperature, 1.0)
    assert [s.dynamic for s in live] == trace.dynamic.tolist()
    assert [s.rate_c_s for s in live] == trace.rate_c_s.tolist()
    assert [s.acceleration_c_s2 for s in live] == trace.acceleration_c_s2.tolist()


@pytest.mark.parametrize("step_c_s2", [5e-6, 1e-5, -5e-5])
def test_a_step_of_the_second_derivative_is_found_after_the_stated_delay(step_c_s2: float) -> None:
    t = np.arange(6000.0)
    begin = 3000.0
    trace = regimes(20.0 + 0.5 * step_c_s2 * np.maximum(t - begin, 0.0) ** 2, 1.0)
    assert not trace.dynamic[2999]
    found = t[switches(trace)[-1]] - begin
    # One sample of rounding up and one by which a second difference is late.
    assert SETTINGS.onset_delay_s(step_c_s2) - 1.0 <= found <= SETTINGS.onset_delay_s(step_c_s2) + 2.0


def test_the_delay_of_a_large_step_is_that_of_three_lags_beginning() -> None:
    # 1 − e^−x(1 + x + x²/2) → x³/6
    share = 1e-6
    assert SETTINGS.onset_delay_s(SETTINGS.enter_c_s2 / share) == pytest.approx(
        SETTINGS.memory_s * (6.0 * share) ** (1.0 / 3.0), rel=0.01
    )
    assert SETTINGS.delay_s == 3.0 * SETTINGS.memory_s


def test_what_stays_between_the_two_thresholds_switches_nothing() -> None:
    t = np.arange(20_000.0)
    period = 3000.0
    size = 0.9 * SETTINGS.enter_c_s2 / (2 * np.pi / period) ** 2  # the filter takes 18 % off that, both ways
    quiet = np.where(t < 5000.0, 20.0, 20.0 + size * np.sin(2 * np.pi * (t - 5000.0) / period))
    trace = regimes(quiet, 1.0)
    assert len(switches(trace)) == 1  # the one from the unknown beginning


def test_what_has_begun_ends_below_the_lower_threshold_only() -> None:
    settings = RegimeSettings(release_rate_c_s=np.inf)
    between = 0.5 * (settings.enter_c_s2 + settings.release_c_s2)
    bends = np.repeat([2.0 * settings.enter_c_s2, between, 0.5 * settings.release_c_s2], 5000)
    trace = regimes(20.0 + np.cumsum(np.cumsum(bends)), 1.0, settings)
    assert trace.dynamic[:10_000].all()
    assert not trace.dynamic[-1]


def test_a_long_ramp_is_dynamic_to_its_end_unless_the_thesis_s_rule_is_asked_for() -> None:
    t, tau, rate, end = np.arange(30_000.0), 900.0, 1.0 / 60.0, 12_000.0

    def lagged(s: np.ndarray) -> np.ndarray:
        return np.where(s > 0.0, rate * (s - tau * -np.expm1(-np.maximum(s, 0.0) / tau)), 0.0)

    case = lagged(t - 4000.0) - lagged(t - 4000.0 - end)
    literal = RegimeSettings(release_rate_c_s=np.inf)
    middle = int(4000.0 + 0.8 * end)
    assert regimes(case, 1.0).dynamic[middle]
    assert not regimes(case, 1.0, literal).dynamic[middle]
    assert not regimes(case, 1.0).dynamic[-1]
    assert len(switches(regimes(case, 1.0))) == 3
    assert len(switches(regimes(case, 1.0, literal))) == 5


def test_the_beginning_counts_as_dynamic_until_it_was_quiet_long_enough() -> None:
    trace = regimes(np.full(1000, 20.0), 1.0)
    assert switches(trace) == [int(SETTINGS.hold_s) - 1]


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({"memory_s": 0.0}, "memory_s"),
        ({"enter_c_s2": float("nan")}, "enter_c_s2"),
        ({"release_c_s2": 1.0}, "release_c_s2"),
        ({"release_rate_c_s": 0.0}, "release_rate_c_s"),
        ({"hold_s": -1.0}, "hold_s"),
    ],
)
def test_bad_settings_are_refused(settings: dict[str, float], field: str) -> None:
    with pytest.raises(BadParameter) as refused:
        RegimeSettings(**settings)
    assert refused.value.field == field


def test_samples_too_far_apart_a_step_too_small_and_no_number_are_refused() -> None:
    with pytest.raises(BadParameter, match="sample_s"):
        RegimeIndicator(100.0)
    with pytest.raises(BadParameter, match="step_c_s2"):
        SETTINGS.onset_delay_s(SETTINGS.enter_c_s2)
    with pytest.raises(UnfitRecording, match="not a number"):
        RegimeIndicator(1.0).step(float("nan"))
