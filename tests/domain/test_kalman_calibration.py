"""The Kalman filter of a constant bias: S's example, the batch mean in the limit, coloured noise told honestly."""

import numpy as np
import pytest
from scipy.stats import kstest

from procedures.analysis.recursive_bias.kalman import RecursiveBias, white_covariance
from procedures.analysis.recursive_bias.window_noise import (
    contiguous_covariance,
    dwell_needed,
    predicted_sd,
    slow_noise_p,
    spectral_covariance,
    window_means,
)
from procedures.core import units
from procedures.core.errors import BadParameter, MissingChannel, UnfitRecording
from procedures.core.limits import Verdict
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.core.unit import TriadRecord, Unit
from procedures.methods.kalman_calibration import METHOD
from procedures.procedure import Evidence
from tests.kit.forward_model import GYRO_NOISE

DEG_H = units.DEG_PER_HOUR


def test_the_worked_example_of_s_5_4_3():
    """Variances 9 and 4, a coin for the noise: 3 − 2, 3 − 2, 3 + 2, 3 + 2, 3 − 2."""
    bias = RecursiveBias(white_covariance(4.0, 5), 0.0, 9.0)
    # Printed with two digits and carried on rounded; table 5.4.1's last row says 0.18, 0.74, 2.39.
    assert bias.gains == pytest.approx([0.69, 0.41, 0.29, 0.23, 0.18], abs=0.006)
    assert bias.variances == pytest.approx([2.77, 1.63, 1.16, 0.90, 0.74], abs=0.011)
    estimates = [bias.update(z) for z in (1.0, 1.0, 5.0, 5.0, 1.0)]
    assert estimates == pytest.approx([0.69, 0.82, 2.03, 2.70, 2.39], abs=0.011)
    exact = [9 / 13, 9 / 22, 9 / 31, 9 / 40, 9 / 49]  # K = P₀/(k·P₀ + R)
    assert bias.gains == pytest.approx(exact)
    assert bias.variances == pytest.approx([4 * k for k in exact])


def test_with_a_wide_prior_it_is_the_batch_mean():
    z = np.random.default_rng(1).normal(size=200) * 2.0 + 3.0
    for prior in (None, 1e12):
        bias = RecursiveBias(white_covariance(4.0, 200), 0.0, prior)
        estimates = [bias.update(float(v)) for v in z]
        assert estimates == pytest.approx(np.cumsum(z) / np.arange(1, 201), rel=1e-9)
        assert bias.sd == pytest.approx(2.0 / np.sqrt(200), rel=1e-9)


def test_under_any_covariance_it_is_generalised_least_squares():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(30, 30))
    covariance = root @ root.T + np.eye(30)
    z = 5.0 + root @ rng.normal(size=30)
    bias = RecursiveBias(covariance, 1.0, 4.0)
    for value in z:
        bias.update(float(value))
    weights = np.linalg.solve(covariance, np.ones(30))
    information = weights.sum() + 1.0 / 4.0
    assert bias.estimate == pytest.approx((weights @ z + 1.0 / 4.0) / information, rel=1e-9)
    assert bias.sd == pytest.approx(1.0 / np.sqrt(information), rel=1e-9)


def test_long_enough_says_the_same_before_and_during_the_dwell():
    bias = RecursiveBias(white_covariance(4.0, 100))
    wanted = bias.enough_at(0.5)
    assert wanted == 16  # 2/√16
    assert bias.enough_at(0.01) is None
    assert bias.sd == np.inf
    reached = next(k for k in range(1, 101) if (bias.update(1.0), bias.sd <= 0.5)[1])
    assert reached == wanted
    with pytest.raises(BadParameter, match="prior_variance"):
        RecursiveBias(white_covariance(1.0, 2), 0.0, 0.0)


def windows(count: int, length: float = 1.0) -> np.ndarray:
    edges = np.arange(count + 1) * length
    return np.column_stack([edges[:-1], edges[1:]])


def test_quantization_alone_is_a_line_through_readings():
    """Windows that share readings: least squares of a line, ``12·Q²/(T²·n(n+1)(n+2))`` for n windows."""
    q, n = 3.0, 40
    bias = RecursiveBias(contiguous_covariance(NoiseCoefficients(quantization=q), windows(n)))
    sd = float(np.sqrt(bias.variances[-1]))
    assert sd == pytest.approx(np.sqrt(12.0 / (n * (n + 1) * (n + 2))) * q, rel=1e-9)
    # S's filter on the same measurements would claim √2·Q/√n, 17 times as much.
    assert np.sqrt(2 * q**2 / n) / sd == pytest.approx(17, abs=1)


def test_slow_noise_cannot_be_averaged_away():
    noise = NoiseCoefficients(random_walk=1e-3, bias_instability=1e-3)
    needed = dwell_needed(noise, 0.05e-3, 0.0, None, 1.0)
    assert needed is None or needed > 1e6  # white noise alone: 400 s
    walking = NoiseCoefficients(random_walk=1e-3, rate_random_walk=1e-4)
    # The bias at launch, through a walk that begins there: σ² → N·K as the dwell grows.
    assert predicted_sd(walking, 1e3, 0.0, None) == pytest.approx(np.sqrt(1e-3 * 1e-4), rel=0.15)
    assert dwell_needed(walking, 2e-4, 0.0, None, 1.0) is None
    reachable = dwell_needed(noise, 3.0e-3, 0.0, None, 0.1)
    assert reachable is not None
    assert predicted_sd(noise, reachable, 0.0, None) == pytest.approx(3.0e-3, rel=0.02)
    white = NoiseCoefficients(random_walk=1e-3)
    assert dwell_needed(white, 1e-4, 0.0, None, 1.0) == pytest.approx(100.0, rel=0.011)  # (N/σ)², bisected to 1 %


def test_estimates_under_coloured_noise_have_the_spread_that_is_claimed():
    """White noise and quantization of the integral, drawn as they happen: a rate integrated, read with an error."""
    rng, n, runs, q = np.random.default_rng(3), 120, 400, 1.0
    noise = NoiseCoefficients(quantization=q, random_walk=0.3)
    covariance = contiguous_covariance(noise, windows(n))
    errors, white_errors, p_values = [], [], []
    for _ in range(runs):
        angle = np.concatenate([[0.0], np.cumsum(0.3 * rng.normal(size=n))])
        z = np.diff(angle + q * rng.normal(size=n + 1))
        bias = RecursiveBias(covariance)
        for value in z:
            bias.update(float(value))
        errors.append(bias.estimate / bias.sd)
        white_errors.append(z.mean() / np.sqrt(np.mean(np.diagonal(covariance)) / n))
        p_values.append(slow_noise_p(z, covariance))
    # A sample standard deviation of 400 is within four times 1/√800 of its truth.
    assert np.std(errors) == pytest.approx(1.0, abs=4 / np.sqrt(2 * runs))
    assert abs(np.mean(errors)) < 4 / np.sqrt(runs)
    assert np.std(white_errors) < 0.5  # the white filter claims three times too much
    assert kstest(p_values, "uniform").pvalue > 1e-4


def recording(values: np.ndarray, rate: float = 10.0, unit: str = "rad/s") -> MemoryRecording:
    channels = (Channel("gyro_x", Quantity.ANGULAR_RATE, unit), Channel("t", Quantity.TEMPERATURE, "degC"))
    samples = np.column_stack([values, np.full(len(values), 20.0)])
    return MemoryRecording(RecordingInfo("r", "S-1", channels, rate, len(values), 5.0), samples)


class Chopped:
    """The same recording in uneven blocks."""

    def __init__(self, whole: MemoryRecording, sizes: list[int]) -> None:
        self.info, self._raw, self._sizes = whole.info, whole.raw, sizes

    def blocks(self):
        return iter(np.split(self._raw, np.cumsum(self._sizes)))


def test_window_means_do_not_depend_on_the_blocks():
    values = np.random.default_rng(4).normal(size=1037)
    whole = window_means(recording(values), ("gyro_x",), 2.5)
    assert whole.means[:, 0] == pytest.approx(values[:1025].reshape(41, 25).mean(axis=1))
    assert whole.windows[-1] == pytest.approx([105.0, 107.5])
    chopped = window_means(Chopped(recording(values), [1, 24, 0, 26, 900, 80]), ("gyro_x",), 2.5)
    assert chopped.means == pytest.approx(whole.means, abs=1e-12)
    assert len(window_means(recording(values), ("gyro_x",), 0.1).means) == 259  # 1037 // 4: at most 300
    with pytest.raises(UnfitRecording, match="at least 20"):
        window_means(recording(values), ("gyro_x",), 10.0)
    with pytest.raises(UnfitRecording, match="not numbers"):
        window_means(recording(np.where(np.arange(1037) == 500, np.nan, values)), ("gyro_x",), 1.0)


def noisy_unit(noise: NoiseCoefficients) -> Unit:
    return Unit("S-1", 10.0, (), gyro=TriadRecord((noise,) * 3))


def test_the_method_with_the_units_record():
    rng = np.random.default_rng(6)
    noise = NoiseCoefficients(random_walk=GYRO_NOISE.random_walk * 10)
    truth = 0.2 * DEG_H
    values = truth + noise.random_walk * np.sqrt(10.0) * rng.normal(size=6000)
    params = METHOD.params(gyro_target_sd_deg_h=0.05)
    result = METHOD.analyse(Evidence((recording(values),)), params, noisy_unit(noise))
    (b,) = result.biases
    assert abs(b.bias - truth) < 4 * b.standard_uncertainty
    assert b.bias == pytest.approx(b.batch_mean, rel=1e-9)
    assert b.standard_uncertainty == pytest.approx(noise.random_walk / np.sqrt(600.0), rel=1e-6)
    # (N/σ)² = (0.014·60/0.05)² = 282 s, in windows of 2 s.
    assert b.enough_after_s == pytest.approx(282.2, abs=2.0)
    assert b.dwell_needed_s == pytest.approx(282.2, rel=0.011)
    assert result.verdict is Verdict.PASS
    assert METHOD.result.model_validate_json(result.model_dump_json()) == result
    assert len(METHOD.report(result).sections) == 2


def test_the_method_without_a_record_and_a_wandering_channel():
    rng = np.random.default_rng(7)
    quiet = 1e-6 * rng.normal(size=3000)
    result = METHOD.analyse(Evidence((recording(quiet),)), METHOD.params(gyro_target_sd_deg_h=1.0), None)
    (b,) = result.biases
    assert b.noise == "observed"
    # One estimate of a variance from 300 windows and of a correlation: 15 % at four sigmas.
    assert b.standard_uncertainty == pytest.approx(1e-6 / np.sqrt(3000), rel=0.2)
    assert result.verdict is Verdict.PASS
    assert any("slower noise is not in the uncertainty" in w for w in result.warnings)
    wandering = quiet + 1e-7 * np.cumsum(rng.normal(size=3000))
    failed = METHOD.analyse(Evidence((recording(wandering),)), METHOD.params(gyro_target_sd_deg_h=1.0), None)
    assert not failed.checks[0].passed


@pytest.mark.parametrize(("q", "seed"), [(0.0, 1), (1.0, 2), (3.0, 3)])
def test_unknown_noise_with_quantization_has_about_the_width_of_the_known_one(q: float, seed: int):
    """Random walk and quantization drawn as they happen; each record's interval against the true covariance's.

    The random walk of 300 windows under quantization is known to 15 % by itself (its spectrum has a few dozen useful
    frequencies), and its uncertainty is added: .6 to 1.6 is four of these.
    """
    rng, n = np.random.default_rng(seed), 300
    true = RecursiveBias(contiguous_covariance(NoiseCoefficients(q, 1.0), windows(n))).variances[-1] ** 0.5
    for _ in range(3):
        angle = np.concatenate([[0.0], np.cumsum(rng.normal(size=n))])
        z = np.diff(angle + q * rng.normal(size=n + 1))
        assert 0.6 < RecursiveBias(spectral_covariance(z, 1.0)).variances[-1] ** 0.5 / true < 1.6


def test_known_input_is_taken_off_and_must_name_a_channel():
    values = 2e-5 + 1e-6 * np.random.default_rng(8).normal(size=1000)
    params = METHOD.params(known_input={"gyro_x": 2e-5})
    (b,) = METHOD.analyse(Evidence((recording(values),)), params, None).biases
    assert abs(b.bias) < 5e-7
    with pytest.raises(BadParameter, match="known_input"):
        METHOD.analyse(Evidence((recording(values),)), METHOD.params(known_input={"gyro_y": 1.0}), None)
    with pytest.raises(MissingChannel):
        METHOD.analyse(Evidence((recording(values),)), METHOD.params(channels=("gyro_z",)), None)
    with pytest.raises(UnfitRecording):
        METHOD.analyse(Evidence(), METHOD.params(), None)


def test_counts_have_no_target():
    values = np.random.default_rng(9).integers(-5, 6, size=1000).astype(float)
    (b,) = METHOD.analyse(Evidence((recording(values, unit="count"),)), METHOD.params(), None).biases
    assert b.target_sd is None
    assert b.enough_after_s is None
