"""Noise coefficients from simulated channels: each process alone, mixtures, what is absent, what does not fit.

Few records, wide tolerances from their claimed uncertainties; the spreads over many: `tests.validation.noise`.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from procedures.analysis.allan.deviation import deviation
from procedures.analysis.allan.read_off import Line, ReadOff, read_off
from procedures.analysis.allan.statistic import MODIFIED_ALLAN, log_sizes
from procedures.analysis.noise_fit.comparison import compare
from procedures.analysis.noise_fit.estimate import PROCESSES, NoiseFit
from procedures.analysis.noise_fit.least_squares import fit_allan
from procedures.analysis.noise_fit.likelihood import fit_noise
from procedures.analysis.noise_fit.powers import FastPowers, slow_powers
from procedures.core import units
from procedures.core.errors import BadParameter, UnfitRecording
from tests.validation.noise_records import (
    ACCELEROMETER,
    ALONE,
    DRIFTING,
    RATE_HZ,
    Scenario,
    cell_records,
    cramer_rao,
    full_rate_blocks,
    gyro,
)

SIGMAS = 4.4
"""1e-5 two-sided: some forty such comparisons fail by chance once in 2500 new seeds."""


def by_likelihood(cells: np.ndarray) -> NoiseFit:
    return fit_noise(slow_powers(cells, 1.0))


def by_least_squares(cells: np.ndarray) -> NoiseFit:
    return fit_allan(deviation(cells, 1.0, sizes=log_sizes(len(cells) // 2, 60)))


def assert_agrees(fit: NoiseFit, scenario: Scenario, process: str) -> None:
    estimate, true = fit.of(process), scenario.of(process)
    assert estimate.value is not None
    assert estimate.standard_uncertainty is not None
    assert abs(estimate.value - true) < SIGMAS * estimate.standard_uncertainty
    assert estimate.lower is not None
    assert estimate.upper is not None
    assert estimate.lower < estimate.value < estimate.upper
    assert estimate.value < estimate.upper_limit


@pytest.mark.parametrize("scenario", ALONE, ids=lambda s: s.title)
def test_each_process_alone_and_no_other(scenario: Scenario) -> None:
    """At a level of 1e-5: an absent process of one of 20 tests comes out once in 5000 seeds."""
    fit = fit_noise(slow_powers(cell_records(scenario, 3)[0], 1.0), level=1e-5)
    for process in PROCESSES:
        if scenario.of(process):
            assert_agrees(fit, scenario, process)
        else:
            assert not fit.of(process).present
            assert 0.0 < fit.of(process).upper_limit < float("inf")


@pytest.mark.parametrize("scenario", [s for s in ALONE if "B" not in s.title], ids=lambda s: s.title)
def test_least_squares_finds_each_process_alone(scenario: Scenario) -> None:
    """Not the flicker: the simulated one ends at 0.3 Hz, the Allan model's does not."""
    fit = by_least_squares(cell_records(scenario, 4)[0])
    for process in PROCESSES:
        if scenario.of(process):
            assert_agrees(fit, scenario, process)


def test_a_drifting_channel_has_all_that_its_record_tells() -> None:
    fit = by_likelihood(cell_records(DRIFTING, 5)[1])
    for process in ("quantization", "random_walk", "rate_random_walk", "rate_ramp"):
        assert_agrees(fit, DRIFTING, process)
    assert fit.slope > 0.0
    assert fit.correlated[-1] == "rate_ramp"
    assert fit.correlation.shape == (len(fit.correlated),) * 2


def test_a_ramp_downwards_has_a_negative_slope() -> None:
    cells = cell_records(ALONE[-1], 6)[0]
    up, down = by_likelihood(cells), by_likelihood(-cells)
    assert down.slope == pytest.approx(-up.slope)
    assert down.rate_ramp == up.rate_ramp


def test_the_claimed_uncertainties_are_the_bound() -> None:
    """Relative, of one record: within 15 %, as the squares they hang on are known to 5 % and better."""
    fit, bound = by_likelihood(cell_records(ACCELEROMETER, 7)[2]), cramer_rao(ACCELEROMETER)
    for process, relative in bound.items():
        estimate = fit.of(process)
        assert estimate.standard_uncertainty == pytest.approx(relative * ACCELEROMETER.of(process), rel=0.15)


def test_the_full_rate_narrows_the_estimate_to_its_bound() -> None:
    """One hour at 400 Hz: N of the gyro to 1.2 % instead of 5 %; every octave fits."""
    scenario = Scenario("gyro, 1 h", 1.0, gyro(0.39, 0.0014))
    fit = fit_noise(*both(scenario, 8, lambda y: y))
    bound = cramer_rao(scenario, 1.0 / RATE_HZ)
    for process in ("quantization", "random_walk"):
        assert_agrees(fit, scenario, process)
        relative = (fit.of(process).standard_uncertainty or 0.0) / scenario.of(process)
        assert relative == pytest.approx(bound[process], rel=0.25)
    assert fit.remarks == ()
    assert all(octave.p_value > 1e-5 for octave in fit.octaves)


def both(scenario: Scenario, seed: int, change: Callable[[np.ndarray], np.ndarray]) -> tuple:
    y = change(np.concatenate(list(full_rate_blocks(scenario, seed))))
    fast = FastPowers(RATE_HZ)
    fast.add(y)
    return slow_powers(y.reshape(-1, 400).mean(axis=1), 1.0), fast.finish()


def test_a_line_is_reported_and_does_not_disturb() -> None:
    """A dither residue of 61.3 Hz at 2 % of the channel's standard deviation."""
    scenario = Scenario("gyro, 1 h", 1.0, gyro(0.39, 0.0014))
    amplitude = 0.02 * 0.39 * units.ARCSEC * np.sqrt(2.0) * RATE_HZ

    def with_line(y: np.ndarray) -> np.ndarray:
        return y + amplitude * np.sin(2.0 * np.pi * 61.3 * np.arange(len(y)) / RATE_HZ)

    fit = fit_noise(*both(scenario, 9, with_line))
    assert [line.frequency_hz for line in fit.lines] == pytest.approx([61.3], abs=0.01)
    assert fit.lines[0].amplitude == pytest.approx(amplitude, rel=0.1)
    assert_agrees(fit, scenario, "quantization")
    assert_agrees(fit, scenario, "random_walk")


def test_a_filtered_channel_is_used_as_far_as_it_fits() -> None:
    """A 20 Hz low-pass: what lies above is left out, the random walk is still known, and the reader is told."""
    scenario = Scenario("gyro, 1 h", 1.0, gyro(0.39, 0.0014))
    b, a = butter(2, 20.0, fs=RATE_HZ)
    fit = fit_noise(*both(scenario, 10, lambda y: np.asarray(lfilter(b, a, y))))
    assert "is left out" in fit.remarks[0]
    assert 1.0 < fit.band_hz[1] < 20.0
    assert [octave.fitted for octave in fit.octaves][-1] is False
    assert_agrees(fit, scenario, "random_walk")


def test_coefficients_are_zero_where_absent() -> None:
    fit = by_likelihood(cell_records(ALONE[0], 3)[0])
    coefficients = fit.coefficients()
    assert coefficients.quantization == fit.quantization.value
    assert coefficients.rate_random_walk == 0.0


def test_the_methods_are_compared_in_sentences() -> None:
    """Against a channel of N alone, known to 0.5 %: what differs in value or in presence, and nothing else."""
    fit = by_likelihood(cell_records(ALONE[1], 3)[0])
    n = fit.random_walk.value or 0.0
    absent = ReadOff(None, None, None, None, None)
    same = replace(absent, random_walk=Line(-0.5, 1.001 * n, 0.01 * n, 1.0, 100.0))
    assert compare(same, fit, fit) == ()
    assert compare(absent, fit, fit)[0].startswith("Random walk: the read-off does not show it, the likelihood does")
    high = replace(same, random_walk=Line(-0.5, 1.2 * n, 0.01 * n, 1.0, 100.0))
    text = "Random walk: the read-off gives 1.2 times the likelihood's value, 18.0 standard"  # 0.2/√(0.01² + 0.0048²)
    assert compare(high, fit, fit)[0].startswith(text)
    drift = replace(same, rate_ramp=Line(1.0, 2.0 * fit.rate_ramp.upper_limit, 1e-12, 1e3, 1e4))
    text = "Rate ramp: the read-off shows it, the likelihood does not; its 95 % limit is 0.5 times that value."
    assert compare(drift, fit, fit) == (text,)
    assert compare(same, replace(fit, random_walk=fit.rate_ramp), fit)[0].startswith(
        "Random walk: least squares does not"
    )


def test_what_cannot_be_fitted_is_refused() -> None:
    y = np.random.default_rng(12).normal(size=400)
    curve = deviation(y, 1.0)
    with pytest.raises(BadParameter, match="level"):
        fit_noise(slow_powers(y, 1.0), level=0.0)
    with pytest.raises(BadParameter, match="confidence"):
        fit_allan(curve, confidence=1.0)
    with pytest.raises(BadParameter, match="modified_allan"):
        fit_allan(deviation(y, 1.0, MODIFIED_ALLAN))
    with pytest.raises(UnfitRecording, match="points from"):
        fit_allan(curve, from_s=180.0)
    fast = FastPowers(100.0, 0.2)
    fast.add(y.repeat(10))
    with pytest.raises(UnfitRecording, match="fit the slow powers alone"):
        fit_noise(slow_powers(y[:12], 1.0), fast.finish())


def test_counts_that_repeat_exactly_over_an_averaging_time_are_no_fault() -> None:
    """Seen once in 500 counters: a variance of exactly zero, by which the fit divided (500 to the user)."""
    found = deviation(np.random.default_rng(2).standard_normal(2000), 1.0)
    exact = replace(found, deviation=np.where(found.tau_s == found.tau_s[3], 0.0, found.deviation))
    fitted = fit_allan(exact)
    n = fitted.of("random_walk").value
    assert n is not None
    assert abs(n - 1.0) < 0.2, "the other averaging times still show the noise"
    assert read_off(exact).random_walk is not None
