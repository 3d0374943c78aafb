"""The dithered counter: its reading error is white with a variance of its own at whatever rate, exact rest included."""

import json
from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from simulators.imu.blocks import Dither
from simulators.imu.counter import FRACTION_BITS, Counter
from simulators.imu.sensor import TriadSensor
from simulators.truth import KeyedBlocks, UnitTruth, default_unit, keyed_generator

SAMPLES = 60000
PHASES = [0, 1 << 31, 1288490188]  # 0, a half and 0.3 pulse: where the fourth moment is least, where it is greatest
ONE_PULSE = (1.0, 1.0, 1.0)
# Pulses a sample: rest, a turn through one pulse in all, a half pulse, something irrational, fast.
RATES = [0.0, 1.0 / SAMPLES, 0.5, 0.1234567, -1234.56789]
KURTOSIS = 4.0
"""Of a reading's error at most: at half a pulse it is −1, 0 or 1 with 1/8, 3/4, 1/8."""


def dithered_counter(seed: int = 1) -> Counter:
    return Counter(ONE_PULSE, PHASES, Dither((seed, 1, "gyro"), 4000, FRACTION_BITS).blocks)


def errors(rate: float) -> np.ndarray:
    """Reading less φ + Θ at the end of each sample, (3, SAMPLES) pulses."""
    readings = np.cumsum(dithered_counter().count(np.full((3, SAMPLES), rate)), axis=1)
    step = np.rint(rate * 2.0**FRACTION_BITS) / 2.0**FRACTION_BITS
    return readings - step * np.arange(1, SAMPLES + 1) - np.array(PHASES)[:, None] / 2.0**FRACTION_BITS


@pytest.mark.parametrize("rate", RATES)
def test_mean_and_variance_of_a_reading_do_not_depend_on_the_rate(rate: float) -> None:
    error = errors(rate)
    # Rounding down takes ½, the dither gives 1 on average. The mean is known to ½/√n, the variance to √((κ−1)/n).
    np.testing.assert_allclose(error.mean(axis=1), 0.5, rtol=0, atol=4 * 0.5 / sqrt(SAMPLES))
    np.testing.assert_allclose(error.var(axis=1), 0.25, rtol=4 * sqrt((KURTOSIS - 1.0) / SAMPLES))


@pytest.mark.parametrize("rate", RATES)
def test_the_error_of_a_reading_is_white(rate: float) -> None:
    error = errors(rate) - 0.5
    for moment in (error, error**2 - 0.25):
        square = np.mean(moment**2)
        for lag in (1, 2, 10):
            # Products of independent numbers of mean zero: known to (their mean square)/√n; three channels.
            assert abs(np.mean(moment[:, lag:] * moment[:, :-lag])) < 4 * square / sqrt(3 * SAMPLES) + 1e-12
    across = np.corrcoef(error)
    assert np.max(np.abs(across - np.eye(3))) < 4 / sqrt(SAMPLES)


@pytest.mark.parametrize("rate", RATES)
def test_the_allan_deviation_falls_with_slope_minus_one_from_the_first_point_on(rate: float) -> None:
    error, q = errors(rate), 0.5
    for m in (1, 2, 3, 7, 30, 100, 1000, 10000):
        second = error[:, 2 * m :] - 2.0 * error[:, m:-m] + error[:, : -2 * m]
        sigma = np.sqrt(np.mean(second**2) / 2.0) / m
        # Squares of second differences go together over m and 2m: 2·(1 + 2·(16 + 1)/36) for normal errors, no more
        # than 5 over the number of terms with the kurtosis above.
        assert sigma == pytest.approx(sqrt(3.0) * q / m, rel=4 * 0.5 * sqrt(5.0 / second.size)), m


def test_without_dither_rest_reads_nothing() -> None:
    assert not Counter(ONE_PULSE, PHASES).count(np.zeros((3, SAMPLES))).any()


def test_sums_that_wrap_round_count_right() -> None:
    counter = dithered_counter()
    step = np.array([[2.0**25 + 0.25], [-(2.0**25) - 0.5], [0.0]])
    total = sum(counter.count(np.repeat(step, 700, axis=1)).sum(axis=1, dtype=np.int64) for _ in range(2))
    # 2^35 pulses pass a reading of 32 bits by several times. The reading may stand up to two pulses ahead.
    ahead = total - np.floor(1400 * step[:, 0] + np.array(PHASES) / 2.0**FRACTION_BITS)
    assert np.all((ahead >= 0) & (ahead <= 2))
    assert counter.ahead == ahead.tolist()


def test_a_dither_is_a_triangle_two_pulses_wide() -> None:
    values = np.zeros((3, 400000), np.int64)
    Dither((3, 1, "gyro"), 4001, FRACTION_BITS).blocks.add_to(values, 5)
    d = np.sort(values.ravel() / 2.0**FRACTION_BITS)
    theory = np.where(d < 1.0, 0.5 * d**2, 1.0 - 0.5 * (2.0 - d) ** 2)
    # Kolmogorov: √n·D passes 2.0 once in 1500 times.
    assert sqrt(d.size) * np.max(np.abs(np.arange(d.size) / d.size - theory)) < 2.0


@pytest.mark.parametrize("dithered", [True, False])
@pytest.mark.parametrize("name", ["gyro", "accelerometer"])
def test_any_pieces_and_a_resume_give_the_same_counts(name: str, dithered: bool) -> None:
    truth, key = replace(default_unit().triad(name), dithered=dithered), (4, 2, name)
    rest = np.array([[1e-7, -2e-7, 3e-7]])
    whole = TriadSensor(truth, 50.0, key).feel(0, 40000, rest)
    sensor, tick, pieces = TriadSensor(truth, 50.0, key), 0, []
    for length in (1, 499, 2, 700, 13000, 10799, 14999):
        pieces.append(sensor.feel(tick, length, rest))
        tick += length
        woken = TriadSensor(truth, 50.0, key)
        woken.resume(json.loads(json.dumps(sensor.checkpoint())))
        sensor = woken
    assert np.concatenate(pieces, axis=1).tobytes() == whole.tobytes()


def test_a_table_that_moves_on_is_felt(quiet_unit: UnitTruth) -> None:
    sensor = TriadSensor(quiet_unit.gyro, 100.0, (1, 1, "gyro"))
    x, y = np.array([[1e-3, 0.0, 0.0]]), np.array([[0.0, 2e-3, 0.0]])
    turned = [sensor.feel(100 * i, 100, v).sum(axis=1) for i, v in enumerate((x, y, np.repeat(x, 100, axis=0), x))]
    np.testing.assert_allclose(
        np.array(turned) * quiet_unit.gyro.pulse, [[0.1, 0, 0], [0, 0.2, 0], [0.1, 0, 0], [0.1, 0, 0]], atol=4e-9
    )


def test_a_generator_set_to_a_block_draws_what_one_made_for_it_draws() -> None:
    blocks = KeyedBlocks(7, "a", 1)
    for block in (3, 0, 12345678, 3):
        generator = blocks.at(block)
        generator.integers(0, 100, 3, dtype=np.uint8)  # leaves half a word behind
        again = blocks.at(block).standard_normal(5)
        np.testing.assert_array_equal(again, keyed_generator(7, "a", 1, block=block).standard_normal(5))
