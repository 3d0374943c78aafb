"""Situations from public reports of noise, on inputs of our own of the same kind: the right answer, or the sentence."""

from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from procedures.core.errors import DomainError
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.core.units import DEG_PER_SQRT_HOUR
from procedures.inspection import analyse_method
from procedures.methods.noise_analysis import METHOD, Params
from procedures.procedure import Evidence

SIGMAS = 4.4
"""1e-5 two-sided."""


def launch(samples: np.ndarray, rate_hz: float, quantity: Quantity = Quantity.ANGULAR_RATE) -> Any:
    """The result of one channel with default parameters."""
    name, unit = ("gyro_x", "rad/s") if quantity is Quantity.ANGULAR_RATE else ("accelerometer_z", "m/s^2")
    info = RecordingInfo("case", "CASE", (Channel(name, quantity, unit),), rate_hz, len(samples))
    evidence = Evidence(recordings=(MemoryRecording(info, samples[:, None]),))
    return analyse_method(METHOD, evidence, Params.model_validate({}), None)


def walk(result: Any) -> Any:
    """The random walk by likelihood."""
    return result.launches[0].channels[0].coefficient("random_walk").likelihood


def assert_is(reading: Any, true: float) -> None:
    assert abs(reading.value - true) < SIGMAS * reading.standard_uncertainty


def test_repeated_samples_of_one_channel_are_answered_and_keep_their_random_walk() -> None:
    """Seven times each: the random walk of the slow part is σ·√(7/rate), whatever is said of the rows."""
    sigma, rate = 0.0019, 210.0
    y = np.repeat(np.random.default_rng(140).normal(0.0, sigma, 30_000), 7)
    said: tuple[str, ...] = ()
    try:
        result = launch(y, rate)
    except DomainError as refusal:  # the inspection may see it first
        said = (str(refusal),)
    else:
        assert_is(walk(result), sigma * np.sqrt(7.0 / rate))
        said = result.warnings
    assert any("it is left out" in sentence or "more than once" in sentence for sentence in said)


def test_a_root_hour_of_white_noise_in_five_minutes() -> None:
    """0.5 °/√h at 800 Hz, 300 s: shorter than six wavelet levels, and answered."""
    true = 0.5 * DEG_PER_SQRT_HOUR
    result = launch(np.random.default_rng(170).normal(0.0, true * np.sqrt(800.0), 240_000), 800.0)
    assert_is(walk(result), true)
    assert result.warnings == ()


@pytest.mark.parametrize(("n", "k"), [(2.4e-3, 7.1e-5), (1.9e-4, 2.7e-6)])
def test_a_simulation_of_known_coefficients_is_found_again(n: float, k: float) -> None:
    """Two-sided density: no factor √2. 90 min at 100 Hz."""
    dice, rate = np.random.default_rng(180), 100.0
    count = int(5400.0 * rate)
    y = dice.normal(0.0, n * np.sqrt(rate), count) + np.cumsum(dice.normal(0.0, k / np.sqrt(rate), count))
    result = launch(y, rate)
    assert_is(walk(result), n)
    found = result.launches[0].channels[0].coefficient("rate_random_walk").likelihood
    # an interval of 95 %: widened to 1e-5 by the ratio of the normal quantiles, as the interval is not symmetric
    assert found.value - (found.value - found.lower) * SIGMAS / 1.96 < k
    assert found.value + (found.upper - found.value) * SIGMAS / 1.96 > k


def test_picked_samples_are_told_from_means_by_the_bandwidth_beside_them() -> None:
    """Every 20th of 240 Hz: √20 times the random walk, at the bandwidth that the table prints beside it."""
    dice, rate, n = np.random.default_rng(190), 240.0, 4.0e-4
    y = dice.normal(0.0, n * np.sqrt(rate), int(1200.0 * rate))
    for samples, expected, hz in (
        (y, n, rate),
        (y[::20], n * np.sqrt(20.0), 12.0),
        (y.reshape(-1, 20).mean(axis=1), n, 12.0),
    ):
        result = launch(samples, hz)
        assert_is(walk(result), expected)
        assert result.launches[0].channels[0].bandwidth_hz == hz / 2.0
        table = METHOD.report(result).sections[0]
        (row,) = [row for row in table.rows if row[1] == "random walk N"]
        assert row[table.columns.index("bandwidth, Hz")] == hz / 2.0


@pytest.mark.parametrize(("order", "part"), [(1, 0.25), (4, 0.25), (2, 0.1)])
def test_a_sensor_behind_its_own_low_pass_keeps_its_random_walk(order: int, part: float) -> None:
    """1 kHz, two minutes: N from where the spectrum is flat, the rest left out in a sentence, and no quantization."""
    n, rate = 1.6e-4, 1000.0
    white = np.random.default_rng(210).normal(0.0, n * np.sqrt(rate), int(122.0 * rate))
    y = sosfilt(butter(order, 2.0 * part, output="sos"), white)[int(rate) :]
    result = launch(9.8 + y, rate, Quantity.SPECIFIC_FORCE)
    assert_is(walk(result), n)
    assert any("it is left out" in sentence for sentence in result.warnings)
    assert result.launches[0].channels[0].coefficient("quantization").likelihood.value is None
