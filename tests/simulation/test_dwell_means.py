"""The short cut for Monte Carlo gives station means of the same distribution as the samples' means."""

from dataclasses import replace
from math import cos, log, pi, sqrt

import numpy as np
import pytest

from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles
from simulators.dwell_means import dwell_means
from simulators.imu.sensor import TriadSensor, launch_coefficients, station_means
from simulators.truth import TriadTruth
from simulators.world import WorldConfig, build

SEEDS = 600
RATE = 20.0
TICKS = np.array([[100.0, 200.0], [313.0, 413.0]])
V = np.array([[0.3, -0.2, 0.1], [-0.1, 0.25, 0.7]])
# Each channel shows another process most: x its pulses, y random walk and what is left of the dither, z bias
# instability and self-heating; all have some of each noise.
TRUTH = TriadTruth(
    (0.5, -0.2, 0.1),
    ((1.1, 0.01, 0.0), (0.02, 0.9, 0.0), (0.0, -0.03, 1.0)),
    quantization=(2.0, 0.1, 0.1),
    random_walk=(0.1, 3.0, 0.1),
    bias_instability=(0.1, 0.1, 1.0),
    flicker_band_s=(2.0, 100.0),
    self_heating_1=(0.0, 0.0, 2.0),
    self_heating_1_time_s=10.0,
    dither_residue=(0.0, 4.0, 0.0),
    dither_frequency_hz=(0.0, 23.33, 0.0),
)


def by_samples(seed: int) -> np.ndarray:
    """Station means from every sample's counts, the unit turning fast between the stations; (2, 3)."""
    sensor = TriadSensor(TRUTH, RATE, (seed, 1, "gyro"))
    means, tick = [], 0
    for (start, stop), v in zip(TICKS.astype(int), V, strict=True):
        sensor.feel(tick, start - tick, np.full((1, 3), 7.7 + seed % 10) / RATE)
        counts = sensor.feel(start, stop - start, v[None] / RATE)
        means.append(counts.mean(axis=1) * TRUTH.pulse * RATE)
        tick = stop
    return np.array(means)


@pytest.fixture(scope="module")
def both() -> tuple[np.ndarray, np.ndarray]:
    """Errors of the means against the coefficients, by both ways, each (SEEDS, 2, 3)."""
    true = launch_coefficients(TRUTH, 0, 1, "gyro").output(V).T
    full = np.array([by_samples(s) for s in range(SEEDS)])
    short = np.array([station_means(TRUTH, RATE, (s, 1, "gyro"), TICKS, V) for s in range(SEEDS)])
    return full - true, short - true


def test_both_ways_have_the_same_moments(both) -> None:
    full, short = both
    # Means: difference of two averages of 600 draws. A variance is known to √(2/600) = 5.8 %, a ratio to 8.2 %.
    scale = np.sqrt((full.var(axis=0) + short.var(axis=0)) / SEEDS)
    assert np.max(np.abs(full.mean(axis=0) - short.mean(axis=0)) / scale) < 4.0
    assert np.max(np.abs(np.log(full.var(axis=0) / short.var(axis=0)))) < 4 * 0.082
    # Correlation of the two stations of one channel (bias instability): known to 1/√600 each.
    for c in range(3):
        of = [np.corrcoef(errors[:, 0, c], errors[:, 1, c])[0, 1] for errors in both]
        assert abs(of[0] - of[1]) < 4 * sqrt(2.0 / SEEDS)


def test_both_ways_have_the_variance_that_theory_says(both) -> None:
    seconds = 5.0
    walk = np.array(TRUTH.random_walk) ** 2 / seconds
    phase = 2.0 * np.array(TRUTH.quantization) ** 2 / seconds**2
    times = np.exp(np.linspace(log(2.0), log(100.0), 2001))
    times = 0.5 * (times[:-1] + times[1:])
    r = seconds / times
    flicker = np.array(TRUTH.bias_instability) ** 2 / pi * log(50.0) * np.mean(2.0 * (r - 1.0 + np.exp(-r)) / r**2)
    # A sinusoid of random phase at two moments 5 s apart: A²·(1 − cos 2πfT), over T².
    residue = np.array([0.0, 16.0 * (1.0 - cos(2.0 * pi * 23.33 * seconds)) / seconds**2, 0.0])
    expected = walk + phase + flicker + residue
    for errors in both:
        # 1200 draws, correlated in z: 5 % … 6 %; the bank of 4 members stands for a continuum: 3 %.
        np.testing.assert_allclose(errors.var(axis=0).mean(axis=0), expected, rtol=0.27)


def test_a_world_s_short_cut_agrees_with_its_recordings(record, means) -> None:
    config = WorldConfig(seed=21, sample_rate_hz=200.0)
    orientations = [TableAngles(0, 0, 90), TableAngles(0, -90, 0), TableAngles(40, 20, 135)]
    stations = [Station(i, str(i), a, None, 1.0, 20.0) for i, a in enumerate(orientations)]
    bench = build(config)
    full = np.array([means(bench, raw) for raw in record(bench, stations)])
    short = dwell_means(config, stations)
    difference = full - np.column_stack([short.gyro, short.accelerometer])
    triads = [config.unit.gyro, config.unit.accelerometer]
    q, n = (np.concatenate([getattr(t, name) for t in triads]) for name in ("quantization", "random_walk"))
    # Same launch, same slow noise; the phase and the random walk are drawn twice.
    sd = np.sqrt(2.0 * (2.0 * q**2 / 20.0**2 + n**2 / 20.0))
    assert np.max(np.abs(difference) / sd) < 4.0
    rate, force = bench.turntable.rest_truth()
    np.testing.assert_allclose(short.rate_b[-1], rate, rtol=0, atol=1e-8 * 7.3e-5)
    np.testing.assert_allclose(short.specific_force_b[-1], force, rtol=0, atol=1e-7)


def test_a_station_without_angles_stays_where_it_was() -> None:
    config = WorldConfig(seed=2)
    there = Station(0, "a", TableAngles(0, 0, 45), None, 0.0, 5.0)
    means = dwell_means(config, [there, replace(there, index=1, angles=None)])
    np.testing.assert_array_equal(means.specific_force_b[0], means.specific_force_b[1])


def test_a_station_without_samples_has_no_mean() -> None:
    with pytest.raises(ValueError, match="holds no sample"):
        dwell_means(WorldConfig(), [Station(0, "empty", TableAngles())])
