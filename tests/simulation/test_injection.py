"""Each process alone, injected and read where IEEE Std 952 reads it; and the line that the dither's residue leaves.

The Allan deviation here is a few lines of its own. With M clusters side by side the mean square of their M − 1
differences has a relative variance of (2/M)·Σρ², ρ the correlation of differences, and σ half that spread.
"""

from dataclasses import replace
from math import log, pi, sqrt

import numpy as np
import pytest

from simulators.imu.noise import TriadNoise
from simulators.imu.sensor import TriadSensor
from simulators.truth import TriadTruth

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SILENT = TriadTruth((0.0, 0.0, 0.0), IDENTITY, (1.0, 1.0, 1.0))
COEFFICIENTS = (0.2, 1.0, 3.0)
HOUR = 3600.0


def side_by_side(integral: np.ndarray, seconds: float) -> np.ndarray:
    """Allan deviation of each row from its integral at the ends of clusters that long, (3,)."""
    return np.sqrt(np.mean(np.diff(integral, 2, axis=1) ** 2, axis=1) / 2.0) / seconds


def slow(truth: TriadTruth, seed: int, hours: float, cluster_s: float) -> np.ndarray:
    """Integral of the slow processes at the ends of clusters, (3, clusters + 1)."""
    ticks = np.arange(0.0, hours * HOUR + 1e-6, cluster_s)
    return TriadNoise(truth, 1.0, (seed, 1, "gyro")).slow_integral(ticks)


def test_quantization_is_read_at_root_three_seconds() -> None:
    truth = replace(SILENT, quantization=COEFFICIENTS)
    sensor = TriadSensor(truth, 100.0, (1, 1, "gyro"))
    counts = sensor.feel(0, 360000, np.array([[0.0, 1e-4, 7.7]]))
    angle = np.cumsum(counts * np.array(truth.pulse)[:, None] - np.array([[0.0], [1e-4], [7.7]]), axis=1)
    m = 173
    second = angle[:, 2 * m :] - 2.0 * angle[:, m:-m] + angle[:, : -2 * m]
    sigma = np.sqrt(np.mean(second**2, axis=1) / 2.0) / (m / 100.0)
    # At every start: relative variance of the mean square below 5/n as in the counter's own test.
    expected = sqrt(3.0) * np.array(COEFFICIENTS) / (m / 100.0)
    np.testing.assert_allclose(sigma, expected, rtol=4 * 0.5 * sqrt(5.0 / 360000))


def test_random_walk_is_read_at_one_second() -> None:
    truth = replace(SILENT, random_walk=COEFFICIENTS)
    angle = np.cumsum(TriadNoise(truth, 10.0, (2, 1, "gyro")).increments(0, 216000), axis=1)[:, 9::10]
    # 21600 clusters, ρ = −½ to the next: 3/M.
    np.testing.assert_allclose(side_by_side(angle, 1.0), COEFFICIENTS, rtol=4 * 0.5 * sqrt(3.0 / 21600))


def test_bias_instability_is_read_on_its_plateau() -> None:
    truth = replace(SILENT, bias_instability=COEFFICIENTS)
    ratios = [side_by_side(slow(truth, seed, 12.0, 100.0), 100.0) / COEFFICIENTS for seed in range(10)]
    # 30 channels of 432 clusters, ρ about −0.4 for flicker: 2.6/M each; two members a decade ripple by 2 %.
    read = np.mean(ratios) / sqrt(2.0 * log(2.0) / pi)
    assert read == pytest.approx(1.0, abs=4 * 0.5 * sqrt(2.6 / (30 * 432)) + 0.02)


def test_rate_random_walk_is_read_at_three_hours() -> None:
    truth = replace(SILENT, rate_random_walk=COEFFICIENTS)
    squares = [side_by_side(slow(truth, s, 60.0, 3 * HOUR), 3 * HOUR) ** 2 for s in range(12)]
    # σ(3 h) = K·√(3 h/3). 36 channels of 20 clusters, ρ = ¼ to the next: 2.25/M of the mean square.
    ratio = np.mean(np.array(squares) / np.array(COEFFICIENTS) ** 2) / HOUR
    assert ratio == pytest.approx(1.0, abs=4 * sqrt(2.25 / (36 * 20)))


def test_a_ramp_is_read_at_root_two_hours() -> None:
    tau = 5091.0
    truth = replace(SILENT, rate_ramp=COEFFICIENTS)
    np.testing.assert_allclose(
        side_by_side(slow(truth, 1, 6.0, tau), tau), np.array(COEFFICIENTS) * tau / sqrt(2.0), rtol=1e-9
    )


RESIDUE = replace(SILENT, dither_residue=(0.3, 0.0, 2.0), dither_frequency_hz=(391.7, 400.0, 13.4))


def line(signal: np.ndarray, frequency_hz: float, rate_hz: float) -> tuple[complex, float]:
    """Complex amplitude of a sinusoid at the ends of ticks, fitted with a constant, and the greatest residual."""
    turn = 2.0 * pi * frequency_hz / rate_hz * np.arange(1, len(signal) + 1)
    design = np.column_stack([np.sin(turn), np.cos(turn), np.ones(len(turn))])
    found = np.linalg.lstsq(design, signal, rcond=None)[0]
    return complex(found[0], found[1]), float(np.max(np.abs(design @ found - signal)))


@pytest.mark.parametrize("tick", [0, 3 * 4000 * 8640])
def test_the_residue_is_one_line_where_it_folds_to(tick: int) -> None:
    noise = TriadNoise(RESIDUE, 400.0, (1, 1, "gyro"))
    angle = np.cumsum(noise.increments(tick, 10000), axis=1)
    assert not angle[1].any()
    for channel, seen_hz in ((0, 8.3), (2, 13.4)):  # 391.7 Hz is seen at 400 − 391.7
        amplitude, rest = line(angle[channel], seen_hz, 400.0)
        # The phase after three days and a half is known to a hundred-millionth of a turn.
        assert abs(amplitude) == pytest.approx(RESIDUE.dither_residue[channel], rel=1e-6)
        assert rest < 1e-6
    ends = tick + np.arange(1, 10001.0)
    told = noise.residue_angle(ends) - noise.residue_angle(np.array([float(tick)]))
    np.testing.assert_allclose(angle, told, rtol=0, atol=1e-6)


def test_the_residue_s_phase_is_drawn_for_each_launch_and_channel() -> None:
    def phases(launch: int) -> list[float]:
        angle = np.cumsum(TriadNoise(RESIDUE, 400.0, (1, launch, "gyro")).increments(0, 4000), axis=1)
        return [float(np.angle(line(angle[c], f, 400.0)[0])) for c, f in ((0, 391.7), (2, 13.4))]

    every = np.array([phases(launch) for launch in range(1, 41)])
    # 80 unit vectors of random directions sum to √80 on average; e^−16 of the time to four times that.
    assert abs(np.exp(1j * every).sum()) < 4 * sqrt(80)
    assert len(set(np.round(every.ravel(), 6))) == 80
