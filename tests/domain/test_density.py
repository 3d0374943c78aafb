"""Power spectral density of a launch: a closed form for white noise, and Welch's method on a random walk."""

import numpy as np
import pytest
from scipy.signal import welch

from procedures.analysis.launch.analysis import analyse_launch
from procedures.analysis.launch.results import ChannelNoise
from procedures.analysis.launch.settings import LaunchSettings
from procedures.core.arrays import Array
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.reports.density import density_figure

RATE_HZ = 20.0
SETTINGS = LaunchSettings(trim_gyros=False, wavelet_rule=None)


def channel_of(samples: Array) -> ChannelNoise:
    channels = (Channel("gyro_x", Quantity.ANGULAR_RATE, "rad/s"),)
    recording = MemoryRecording(RecordingInfo("r", "S-1", channels, RATE_HZ, len(samples)), samples[:, None])
    return analyse_launch(recording, "launch", SETTINGS).channels[0]


def test_white_noise_has_twice_its_square() -> None:
    n, sd = 100_000, 3e-6
    found = channel_of(sd * np.random.default_rng(81).normal(size=n)).density
    assert found is not None
    f, s = np.array(found.frequency_hz), np.array(found.density)
    assert np.all(np.diff(f) > 0.0)
    expected = 2.0 * sd**2 / RATE_HZ
    # Above 0.1 Hz: bins of many modes each; n modes in all give the mean to √(2/n), here a twentieth of the tolerance.
    fast = (f > 0.1) & (f < 0.45 * RATE_HZ)
    assert np.average(s[fast], weights=np.gradient(f)[fast]) == pytest.approx(expected, rel=0.05)
    assert np.average(s[~fast & (f < 0.1)]) == pytest.approx(expected, rel=4.0 * np.sqrt(2.0 / np.sum(f < 0.1)))
    inside = (np.array(found.lower) <= expected) & (expected <= np.array(found.upper))
    # 95 % intervals, of bins that taper and overlap correlate a little: four binomial deviations.
    assert np.mean(inside) > 0.95 - 4.0 * np.sqrt(0.95 * 0.05 / len(f))


def test_a_random_walk_agrees_with_welch() -> None:
    rng, n = np.random.default_rng(82), 400_000
    samples = 1e-6 * rng.normal(size=n) + np.cumsum(2e-9 * rng.normal(size=n))
    channel = channel_of(samples)
    assert channel.density is not None
    f, s = welch(samples, RATE_HZ, nperseg=8192, detrend="linear")
    # From ten bins of Welch's on, where its window no longer leaks the walk; 97 segments a bin: 14 % each, and
    # averages over a third of a decade of both.
    for low, high in ((0.03, 0.06), (0.06, 0.12), (0.12, 0.3), (0.3, 1.0), (1.0, 3.0)):
        theirs = np.mean(s[(f >= low) & (f < high)])
        own = np.array(
            [v for x, v in zip(channel.density.frequency_hz, channel.density.density, strict=True) if low <= x < high]
        )
        assert np.mean(own) == pytest.approx(theirs, rel=0.25)
    figure = density_figure([channel], ["launch"])
    assert figure is not None
    model = {line.name: line for line in figure.series if line.style == "reference"}
    assert {"random walk", "rate random walk"} <= set(model)
