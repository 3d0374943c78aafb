"""Warm-up: noise is not taken for a transient, a transient's end is found, and the noise beside it is the noise."""

import numpy as np
import pytest
from scipy.fft import dct
from scipy.stats import binom, chi2

from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.coloured_noise import cosine_series, fit_noise, unit_variances
from procedures.analysis.warm_up.end import WarmUp, find_warm_up
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.noise import NoiseCoefficients
from tests.validation.conditioning_curves import DECAYING, STOPPING, Curve, level_of
from tests.validation.conditioning_noise import ACCELEROMETER, GYRO_Z, HOURS_6, STATIONARY, Channel, noise_cells


def found(channel: Channel, curve: Curve, levels: float, seed: int, start_s: float = 0.0) -> WarmUp | None:
    rng = np.random.default_rng([seed, 21])
    amplitude = levels * level_of(channel.noise)
    return find_warm_up(noise_cells(channel.noise, rng, HOURS_6) + amplitude * curve.cells(), 1.0, start_s)


@pytest.mark.parametrize("count", [64, 101])
def test_variances_of_cosines_are_those_of_the_covariance(count: int) -> None:
    """Against the whole matrix of `station_noise`, whose flicker has a band: a wide one, 1e-5 of it remains."""
    windows = np.arange(count)[:, None] * 3.0 + np.array([0.0, 3.0])
    transform = dct(np.eye(count), type=2, norm="ortho", axis=0)
    differences = np.diff(np.eye(count + 1), axis=0) / 3.0
    wide = (1e-3, 1e7)
    matrices = [
        differences @ differences.T,
        mean_covariance(NoiseCoefficients(random_walk=1.0), windows),
        mean_covariance(NoiseCoefficients(bias_instability=1.0, flicker_band_s=wide), windows),
        mean_covariance(NoiseCoefficients(rate_random_walk=1.0), windows),
    ]
    expected = [np.diagonal(transform @ matrix @ transform.T)[1:] for matrix in matrices]
    assert unit_variances(count, 3.0) == pytest.approx(np.array(expected), rel=2e-3)


@pytest.mark.parametrize("channel", [ACCELEROMETER, STATIONARY[-1]], ids=lambda c: c.name)
def test_the_noise_is_fitted(channel: Channel) -> None:
    """Means of 20 records within 5 of their own standard errors; likelihood's bias is of the order of one of them."""
    rows = []
    for seed in range(20):
        series = cosine_series(noise_cells(channel.noise, np.random.default_rng([seed, 22]), HOURS_6), 1.0)
        noise = fit_noise(series.coefficients, series.unit_variances).noise
        rows.append([noise.quantization, noise.random_walk, noise.bias_instability])
    mean, error = np.mean(rows, axis=0), np.std(rows, axis=0, ddof=1) / np.sqrt(20)
    true = [channel.noise.quantization, channel.noise.random_walk, channel.noise.bias_instability]
    for value, sd, expected in zip(mean, error, true, strict=True):
        if expected > 0.0:
            assert value == pytest.approx(expected, abs=5 * sd)


def test_noise_is_not_a_transient() -> None:
    """At most 5 % of stationary records: of 36, as many as that would exceed once in a thousand times."""
    alarms = [
        find_warm_up(noise_cells(c.noise, np.random.default_rng([seed, 23]), HOURS_6), 1.0) is not None
        for c in STATIONARY
        for seed in range(6)
    ]
    assert sum(alarms) <= binom.isf(1e-3, len(alarms), 0.05)


@pytest.mark.parametrize("curve", STOPPING, ids=lambda c: c.name)
def test_the_end_of_a_transient_that_stops(curve: Curve) -> None:
    """Within 10 % of the stop, at 400 times the level; a cosine is below the level for its last 3 %."""
    for seed in range(3):
        warm_up = found(GYRO_Z, curve, 400.0, seed)
        assert warm_up is not None
        assert warm_up.end_s == pytest.approx(curve.times[0], rel=0.10), warm_up.shape
        assert warm_up.has_ended
        assert warm_up.first_cell == int(np.ceil(warm_up.end_s))


@pytest.mark.parametrize("curve", DECAYING, ids=lambda c: c.name)
def test_the_end_of_a_decay_is_where_it_crosses_the_level(curve: Curve) -> None:
    """Within 10 % of the closed form, at 1000 times the level, in the noise of a gyro and of an accelerometer."""
    for seed in range(3):
        warm_up = found(GYRO_Z, curve, 1000.0, seed)
        assert warm_up is not None
        assert warm_up.end_s == pytest.approx(curve.end_s(1e-3), rel=0.10), warm_up.shape


def test_the_end_scatters_as_it_says() -> None:
    """One exponential, 16 records: the normalised errors' spread within chi-square's limits of 0.1 %."""
    curve, errors = DECAYING[1], []
    for seed in range(16):
        warm_up = found(GYRO_Z, curve, 150.0, 100 + seed)
        assert warm_up is not None
        if warm_up.shape == "one exponential":
            errors.append((warm_up.end_s - curve.end_s(1.0 / 150.0)) / warm_up.end_sd_s)
    assert len(errors) >= 12
    low, high = chi2.ppf([5e-4, 1 - 5e-4], len(errors))
    assert low <= np.sum(np.square(errors)) <= high, errors


def test_the_sign_the_size_and_the_start_do_not_matter() -> None:
    cells = noise_cells(GYRO_Z.noise, np.random.default_rng(24), HOURS_6) + 0.5 * DECAYING[0].cells()
    first, turned = find_warm_up(cells, 1.0), find_warm_up(15.0 - 1e-6 * cells, 1.0, 300.0)
    assert first is not None
    assert turned is not None
    assert turned.end_s == pytest.approx(first.end_s + 300.0, rel=1e-3)
    assert turned.first_cell == pytest.approx(first.first_cell, abs=2)
    assert turned.amplitude == pytest.approx(-1e-6 * first.amplitude, rel=1e-3)
    t = np.array([0.0, 100.0, 400.0])
    assert turned.curve(t + 300.0) == pytest.approx(-1e-6 * first.curve(t), rel=1e-2)
    assert first.curve(t) == pytest.approx(0.5 * np.exp(-t / 120.0), abs=5 * first.amplitude_sd)


def test_a_drift_to_the_end_of_the_record_has_not_ended() -> None:
    drift = -0.3 * np.arange(HOURS_6) / HOURS_6
    warm_up = find_warm_up(noise_cells(GYRO_Z.noise, np.random.default_rng(25), HOURS_6) + drift, 1.0)
    assert warm_up is not None
    assert not warm_up.has_ended
    assert warm_up.first_cell == HOURS_6


def test_what_cannot_be_searched_is_refused() -> None:
    cells = np.random.default_rng(26).standard_normal(1000)
    for field, changed in (
        ("cell_s", {"cell_s": 0.0}),
        ("start_s", {"start_s": -1.0}),
        ("averaging_s", {"averaging_s": 0.0}),
        ("fraction", {"fraction": 0.0}),
        ("significance", {"significance": 1.0}),
    ):
        with pytest.raises(BadParameter) as refused:
            find_warm_up(cells, **{"cell_s": 1.0, **changed})
        assert refused.value.field == field
    for bad, message in ((cells[:63], "63 cells"), (np.append(cells, np.nan), "1000"), (np.ones(100), "equal")):
        with pytest.raises(UnfitRecording, match=message):
            find_warm_up(bad, 1.0)
