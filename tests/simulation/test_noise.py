"""Each noise process alone shows its coefficient; the same key gives the same bytes in whatever pieces."""

import json
from dataclasses import replace
from math import exp, log, pi, sqrt

import numpy as np
import pytest

from simulators.imu.counter import Counter
from simulators.imu.noise import TriadNoise, cell_mean
from simulators.truth import TriadTruth

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SILENT = TriadTruth((0.0, 0.0, 0.0), IDENTITY, (1.0, 1.0, 1.0))
EVERYTHING = replace(
    SILENT,
    random_walk=(1.0, 2.0, 0.5),
    bias_instability=(1.0, 0.5, 0.0),
    rate_random_walk=(0.1, 0.0, 0.2),
    rate_ramp=(1e-3, 0.0, -1e-3),
    startup=(1.0, 0.0, 2.0),
    self_heating_1=(0.0, 3.0, 1.0),
    self_heating_2=(1.0, -1.0, 0.0),
    dither_residue=(0.5, 0.0, 2.0),
    dither_frequency_hz=(3.3, 4.0, 17.1),
)
BLOCK = 500  # seconds of a slow block


def noise(truth: TriadTruth, rate_hz: float = 10.0, seed: int = 1, launch: int = 1) -> TriadNoise:
    return TriadNoise(truth, rate_hz, (seed, launch, "gyro"))


def slow_rates(truth: TriadTruth, blocks: int) -> np.ndarray:
    """Rates of the slow processes averaged over half seconds, (3, cells), from their integral."""
    knots = np.arange(0, blocks * 1000 * 5, 5, dtype=float)
    return np.diff(noise(truth).slow_integral(knots), axis=1) / 0.5


def test_a_silent_triad_is_silent() -> None:
    assert not noise(SILENT).increments(0, 7000).any()


def test_angle_random_walk_shows_its_coefficient() -> None:
    n = np.array([1.0, 2.0, 0.5])
    steps = noise(replace(SILENT, random_walk=tuple(n))).increments(0, 40000)
    # Var of an increment is N²·dt; 40000 draws give the deviation to 0.35 %, 4 sigma.
    np.testing.assert_allclose(np.std(steps, axis=1), n * sqrt(0.1), rtol=0.015)
    walk = steps.reshape(3, 400, 100).sum(axis=2)  # 10 s: independence, N·√10 to 3.5 %
    np.testing.assert_allclose(np.std(walk, axis=1), n * sqrt(10.0), rtol=0.15)
    assert np.max(np.abs(np.corrcoef(steps) - np.eye(3))) < 4 / sqrt(40000)


def test_quantization_without_dither_shows_its_coefficient() -> None:
    q = 0.7
    counter = Counter((q * sqrt(12.0),) * 3, [0, 10**9, 3 * 10**9])
    rate = np.array([[0.1234], [2.71828], [-1.41421]])
    read = np.cumsum(counter.count(np.repeat(rate, 30000, axis=1)), axis=1) * q * sqrt(12.0)
    error = read - rate * np.arange(1, 30001)
    # Phases of an irrational step fill a pulse evenly: standard deviation LSB/√12 = Q, to a part in a thousand.
    np.testing.assert_allclose(np.std(error, axis=1), q, rtol=2e-3)


def test_bias_instability_has_the_flat_allan_deviation_of_its_coefficient() -> None:
    truth = replace(SILENT, bias_instability=(1.0, 2.0, 0.5), flicker_band_s=(0.5, 1e5))
    rates = slow_rates(truth, 100) / np.array([[1.0], [2.0], [0.5]])
    clusters = rates[:, : 99999 // 40 * 40].reshape(3, -1, 40).mean(axis=2)  # 20 s
    allan = 0.5 * np.mean(np.diff(clusters, axis=1) ** 2)
    # (2 ln 2/π)B². 7500 clusters: the variance is known to about √(3/7500) = 2 %, the bank's ripple is 2 %.
    assert allan == pytest.approx(2.0 * log(2.0) / pi, rel=0.10)


def test_bias_instability_has_the_variance_of_its_band_from_the_first_moment() -> None:
    truth = replace(SILENT, bias_instability=(1.0, 1.0, 1.0), flicker_band_s=(10.0, 1e5))
    first = np.array([noise(truth, seed=s).slow_integral(np.array([5.0]))[:, 0] / 0.5 for s in range(300)])
    # Stationary from power-up: (1/π) ln 10⁴, less 0.2 % for the average over half a second. 900 draws: 4.7 %, 4 sigma.
    assert np.mean(first**2) == pytest.approx(log(1e4) / pi, rel=0.19)


def test_mean_over_a_cell_of_a_gauss_markov_process_by_hand() -> None:
    decay, weight, residue = (v[0] for v in cell_mean(np.array([1.0])))
    assert decay == pytest.approx(exp(-1.0))
    assert weight == pytest.approx(0.46211715726)  # tanh ½
    assert residue == pytest.approx(2.0 * exp(-1.0) - 2.0 * 0.46211715726**2 * (1.0 + exp(-1.0)))  # 0.1515
    below, above = cell_mean(np.array([0.999e-3, 1.001e-3]))[2]
    assert below == pytest.approx(above, rel=3e-3)  # the series joins the formula


def test_rate_random_walk_shows_its_coefficient() -> None:
    k = np.array([0.1, 1.0, 3.0])
    rates = slow_rates(replace(SILENT, rate_random_walk=tuple(k)), 40)
    steps = np.diff(rates[:, ::20], axis=1)  # 10 s apart
    # Var of a difference of half-second means: K²·(10 − 0.5/3). 4000 draws a channel: variance to 2.2 %, 4 sigma.
    np.testing.assert_allclose(np.mean(steps**2, axis=1), k**2 * (10.0 - 0.5 / 3.0), rtol=0.09)
    # Neighbouring means differ by ⅔K²Δ, as averages of a continuous walk do. 40000 draws: 0.7 %, 4 sigma.
    np.testing.assert_allclose(np.mean(np.diff(rates, axis=1) ** 2, axis=1), k**2 * 0.5 * 2.0 / 3.0, rtol=0.03)


def test_a_ramp_integrates_to_half_r_t_squared() -> None:
    truth = replace(SILENT, rate_ramp=(2e-3, 0.0, -1e-3))
    total = noise(truth).increments(0, 12000).sum(axis=1)
    np.testing.assert_allclose(total, np.array([2e-3, 0.0, -1e-3]) * 1200.0**2 / 2.0, rtol=1e-9)


def test_a_start_up_transient_integrates_to_amplitude_times_its_time() -> None:
    truth = replace(SILENT, startup=(1.0, -2.0, 0.0), startup_time_s=100.0)
    total = noise(truth).increments(0, 6000).sum(axis=1)
    np.testing.assert_allclose(total, np.array([1.0, -2.0, 0.0]) * 100.0 * (1.0 - exp(-6.0)), rtol=1e-9)


def test_self_heating_is_the_curve_that_the_thesis_fits() -> None:
    amplitudes = {"self_heating_1": (3.0, 0.0, -1.0), "self_heating_2": (2.0, 5.0, 0.5)}
    truth = replace(SILENT, **amplitudes, self_heating_1_time_s=70.0, self_heating_2_time_s=900.0)
    ticks = np.array([1, 10, 333, 5000, 12000, 20000])
    got = np.cumsum(noise(truth).increments(0, 20000), axis=1)[:, ticks - 1]
    # The integral of A₁·e^(−t/T₁) + A₂·e^(−t/T₂) from power-up; a mean over half a second is held, so whole cells.
    t = np.ceil(ticks / 5) * 0.5
    inside = (ticks / 10 - (t - 0.5)) / 0.5

    def integral(a, b, at):
        return a * 70.0 * (1.0 - np.exp(-at / 70.0)) + b * 900.0 * (1.0 - np.exp(-at / 900.0))

    for row, a, b in zip(got, *amplitudes.values(), strict=True):
        before, after = integral(a, b, t - 0.5), integral(a, b, t)
        np.testing.assert_allclose(row, before + inside * (after - before), rtol=1e-9)


@pytest.mark.parametrize("rate_hz", [1.0, 25.0, 400.0])
def test_any_pieces_give_the_same_bytes(rate_hz: float) -> None:
    whole = noise(EVERYTHING, rate_hz).increments(0, 30000)
    source, tick, pieces = noise(EVERYTHING, rate_hz), 0, []
    for length in [1, 7, 4000, 13, 9000, 3999, 30000]:
        length = min(length, 30000 - tick)
        pieces.append(source.increments(tick, length))
        tick += length
    assert np.concatenate(pieces, axis=1).tobytes() == whole.tobytes()


@pytest.mark.parametrize("tick", [0, 99, 5000, 12345])
def test_a_resumed_noise_goes_on_with_the_same_bytes(tick: int) -> None:
    undisturbed = noise(EVERYTHING)
    undisturbed.increments(0, tick)
    resumed = noise(EVERYTHING)
    resumed.resume(json.loads(json.dumps(undisturbed.checkpoint())))
    assert resumed.increments(tick, 9000).tobytes() == undisturbed.increments(tick, 9000).tobytes()


def test_seeds_launches_and_channels_have_noise_of_their_own() -> None:
    truth = replace(EVERYTHING, random_walk=(1.0, 1.0, 1.0), dither_residue=(0.0, 0.0, 0.0))
    draws = np.concatenate([noise(truth, seed=s, launch=n).increments(0, 20000) for s in (1, 2) for n in (1, 2)])
    white = np.diff(draws, axis=1)
    assert np.max(np.abs(np.corrcoef(white) - np.eye(12))) < 5 / sqrt(20000)


def test_the_integral_is_that_of_the_increments() -> None:
    truth = replace(EVERYTHING, random_walk=(0.0, 0.0, 0.0), dither_residue=(0.0, 0.0, 0.0))
    ticks = np.array([1.0, 4.0, 5.0, 77.0, 5000.0, 7123.0])
    sums = np.cumsum(noise(truth).increments(0, 8000), axis=1)[:, ticks.astype(int) - 1]
    np.testing.assert_allclose(noise(truth).slow_integral(ticks), sums, rtol=1e-9, atol=1e-9)
