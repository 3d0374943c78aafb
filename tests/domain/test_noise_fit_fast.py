"""Noise of whole channels that is faster than a cell, or less than the step of its samples.

One record a case; the shares over many: ``tests.validation.foreign_noise``.
"""

from typing import Any

import numpy as np
import pytest

from procedures.analysis.launch.resolution import HIDDEN, rounded_noise
from tests.validation.foreign_noise import analysed
from tests.validation.foreign_records import WALK, Record, correlated, flicker, white

RATE_HZ, SECONDS = 100.0, 1200
SURE = 4.4
"""Standard uncertainties that one error of a hundred thousand exceeds."""


def only_channel(samples: np.ndarray, *, codes: bool = False) -> Any:
    return analysed(Record(samples, RATE_HZ, codes=codes)).launches[0].channels[0]


def reading(channel: Any, process: str) -> Any:
    return channel.coefficient(process).likelihood


@pytest.mark.parametrize("equal_hz", [0.3, 1.0, 3.0])
def test_a_flicker_up_to_half_of_the_rate_leaves_the_random_walk_what_it_is(equal_hz: float) -> None:
    """White noise is as strong as the flicker at `equal_hz`. N within 2 %: 4.4 standard uncertainties of 0.25 %, and
    as much for what the end of the flicker's band leaves open."""
    rng, n = np.random.default_rng(4), int(SECONDS * RATE_HZ)
    b = WALK * np.sqrt(2.0 * np.pi * equal_hz)
    channel = only_channel(white(rng, n, RATE_HZ) + flicker(rng, n, RATE_HZ, b, 0.0))
    assert reading(channel, "random_walk").value == pytest.approx(WALK, rel=0.02)
    found = reading(channel, "bias_instability")
    assert abs(found.value - b) < SURE * found.standard_uncertainty
    assert reading(channel, "quantization").value is None
    assert channel.flicker_corner_s is not None
    assert channel.flicker_corner_s < 0.05
    assert not any("left out" in sentence for sentence in channel.warnings)


def test_a_process_of_a_third_of_a_second_is_named_and_is_no_quantization() -> None:
    rng, n, time_s = np.random.default_rng(5), int(SECONDS * RATE_HZ), 0.3
    sigma = 2.5 * WALK
    channel = only_channel(white(rng, n, RATE_HZ) + correlated(rng, n, RATE_HZ, sigma, time_s))
    walk, found = reading(channel, "random_walk"), channel.correlated
    assert walk.lower < WALK < walk.upper
    assert abs(found.time_s - time_s) < SURE * found.time_sd_s
    assert abs(found.driving - sigma * np.sqrt(2.0 / time_s)) < SURE * found.driving_sd
    assert reading(channel, "quantization").value is None
    assert reading(channel, "bias_instability").value is None
    assert any("Gauss–Markov process is in the noise" in sentence for sentence in channel.warnings)


def test_a_process_as_fast_as_a_filter_leaves_a_limit_of_the_random_walk_and_both_its_values() -> None:
    """Low-pass filter and reader, or white noise and process: √(N² + q²τ²) below, N above, 1.871 times at sigma 5N."""
    rng, n, time_s = np.random.default_rng(6), int(SECONDS * RATE_HZ), 0.05
    channel = only_channel(white(rng, n, RATE_HZ) + correlated(rng, n, RATE_HZ, 5.0 * WALK, time_s))
    walk, below = reading(channel, "random_walk"), WALK * np.sqrt(1.0 + 2.0 * 25.0 * time_s)
    assert (walk.value, walk.described) == (None, False)
    assert below < walk.upper_limit < 1.05 * below
    # 3e-4 rad/√s is 1.03 deg/√h
    assert any("random walk is 1.9" in s and "above it 1.0" in s for s in channel.warnings), channel.warnings
    assert channel.averaging.time_s is None


@pytest.mark.parametrize("mean", [0.1, 0.45, 0.5])
@pytest.mark.parametrize("codes", [False, True])
def test_steps_that_hide_the_noise_leave_limits_whatever_the_numbers_are(mean: float, codes: bool) -> None:
    """An accelerometer of steps 0.153 m/s², its noise an eighth of one: two or three values, floats or codes."""
    rng, n, sd = np.random.default_rng(7), int(SECONDS * RATE_HZ), 0.13
    step = 1.0 if codes else 0.153e-3
    channel = only_channel(np.rint(mean + sd * rng.standard_normal(n)) * step, codes=codes)
    walk = reading(channel, "random_walk")
    assert (walk.value, walk.described) == (None, False)
    true = sd * step / np.sqrt(RATE_HZ)
    # Samples that are one of two values vary by half a step at most.
    assert true < walk.upper_limit < 0.6 * step / np.sqrt(RATE_HZ)
    assert all(reading(channel, p).value is None for p in ("bias_instability", "rate_random_walk", "rate_ramp"))
    assert any("rounding hides most of it" in sentence for sentence in channel.warnings)


@pytest.mark.parametrize("mean", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("sd", [0.25, 0.3])
def test_the_noise_under_a_step_is_estimated_whatever_the_mean_is(sd: float, mean: float) -> None:
    """The median of 48 windows of 2048 scatters by less than 2 %. Where hardly a window has a third value, at four
    standard deviations, it is the bound 1/3.3."""
    samples = np.rint(mean + sd * np.random.default_rng(8).standard_normal(200_000))
    found = rounded_noise(samples * 0.25)
    assert found is not None
    assert found[0] == pytest.approx(0.25)
    assert 0.94 * sd < found[1] / 0.25 < max(1.06 * sd, 1.0 / 3.2)


@pytest.mark.parametrize("mean", [0.0, 0.2, 0.5])
def test_noise_of_more_than_a_third_of_a_step_is_not_hidden(mean: float) -> None:
    rng = np.random.default_rng(9)
    for sd in (1.15 * HIDDEN, 1.0, 30.0):
        assert rounded_noise(np.rint(mean + sd * rng.standard_normal(200_000))) is None
    assert rounded_noise(rng.standard_normal(5000)) is None
    assert rounded_noise(np.full(5000, 0.3)) is None
