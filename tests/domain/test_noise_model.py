"""Parts of the noise model besides the five coefficients, each against a closed form or a record made elsewhere."""

from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from procedures.analysis.noise_fit.columns import cosine_powers, covariances, sine_edged_taper, tapered_powers
from procedures.analysis.noise_fit.extensions import flicker_from, gauss_markov
from procedures.analysis.noise_fit.joined import Joined, joined_at
from procedures.analysis.noise_fit.powers import FastPowers, slow_powers
from procedures.analysis.noise_fit.slow_lines import without_lines
from procedures.core.arrays import Array
from procedures.core.noise import NoiseCoefficients
from tests.validation.foreign_noise import analysed
from tests.validation.foreign_records import FOREIGN, WALK, Record, counter, walk, white

SIGMAS = 4.4
"""1e-5 two-sided."""
RATE_HZ, CELLS = 50.0, 1500


def channel(record: Record) -> Any:
    return analysed(record).launches[0].channels[0]


def joined() -> tuple[Joined, int]:
    """Bins of a white record, and the length of its segments."""
    y = np.random.default_rng(1).normal(size=int(CELLS * RATE_HZ))
    fast = FastPowers(RATE_HZ, 0.03)
    fast.add(y)
    slow = slow_powers(y.reshape(CELLS, -1).mean(axis=1), 1.0)
    return joined_at(slow, fast.finish(), 0.03), 1 << int(np.ceil(np.log2(4 * RATE_HZ / 0.03)))


def process_covariances(count: int, cell_s: float, time_s: float) -> Array:
    """Covariances of means over cells, of a process of unit variance."""
    ratio = time_s / cell_s
    a = np.exp(-1.0 / ratio)
    gamma = ratio**2 * (1.0 - a) ** 2 * a ** (np.arange(count) - 1.0)
    gamma[0] = 2.0 * ratio**2 * (1.0 / ratio - 1.0 + a)
    return gamma


def exact_in_bins(bins: Joined, slow: Array, fast: Array, length: int) -> Array:
    """Powers of slow modes 1…n−1 and of fast modes 0…L/2, at the bins' mean frequencies."""
    slow_hz = np.arange(1, CELLS) / (2.0 * CELLS)
    fast_hz = np.arange(length // 2 + 1) * RATE_HZ / length
    at = bins.frequency_hz
    return np.where(bins.is_fast, np.interp(at, fast_hz, fast), np.interp(at, slow_hz, slow))


@pytest.mark.parametrize("time_s", [3.0, 20.0, 100.0])
def test_a_gauss_markov_process_has_the_powers_of_its_covariance(time_s: float) -> None:
    """The closed form is that of an endless record: exact but for the lowest modes of a record and of a segment."""
    bins, length = joined()
    taper = sine_edged_taper(length, length // 8)
    taper /= np.sqrt(np.sum(taper**2))
    slow = cosine_powers(process_covariances(CELLS, 1.0, time_s))
    fast = tapered_powers(process_covariances(length, 1.0 / RATE_HZ, time_s), taper)
    ratio = gauss_markov(bins, time_s) / exact_in_bins(bins, slow, fast, length)
    assert np.quantile(np.abs(ratio - 1.0), 0.95) < 0.02
    assert np.max(np.abs(ratio - 1.0)) < 0.15


@pytest.mark.parametrize("corner_s", [0.1, 4.0, 20.0])
def test_a_flicker_of_another_corner_has_the_powers_of_its_covariance(corner_s: float) -> None:
    """Up to three octaves above the corner: beyond, it is a small difference of large numbers."""
    bins, length = joined()
    taper = sine_edged_taper(length, length // 8)
    taper /= np.sqrt(np.sum(taper**2))
    band = (corner_s, 1e5)
    slow = cosine_powers(covariances(CELLS, 1.0, band))[2]
    fast = tapered_powers(covariances(length, 1.0 / RATE_HZ, band), taper)[2]
    told = bins.frequency_hz < 8.0 / (2.0 * np.pi * corner_s)
    ratio = (flicker_from(bins, corner_s) / exact_in_bins(bins, slow, fast, length))[told]
    assert np.quantile(np.abs(ratio - 1.0), 0.9) < 0.03
    assert np.max(np.abs(ratio - 1.0)) < 0.15


def test_a_slow_line_is_taken_out_with_its_frequency_and_amplitude() -> None:
    """900 s in two hours beside white noise of one: amplitude ± √(2/n) (least squares), its frequency."""
    n, amplitude, f = 7200, 0.4, 1.0 / 900.0
    t = np.arange(n) + 0.5
    y = np.random.default_rng(2).normal(size=n) + amplitude * np.sin(2.0 * np.pi * f * t + 1.0) + 3.0 + 1e-4 * t
    found = without_lines(y, 1.0, np.ones(n - 1))
    assert len(found.lines) == 1
    assert found.lines[0].amplitude == pytest.approx(amplitude, abs=SIGMAS * np.sqrt(2.0 / n))
    spread = np.sqrt(6.0) / (np.pi * n * amplitude * np.sqrt(n / 2.0))
    assert found.lines[0].frequency_hz == pytest.approx(f, abs=SIGMAS * spread)
    assert np.ptp(np.polyfit(t, found.cells, 1) - [1e-4, 3.0]) < 0.2  # mean and slope stay


def test_drifting_noise_has_no_lines() -> None:
    """At 1e-4 a record, 40 records of white noise and a walk: more than one comes by chance once in 1e5."""
    seen = 0
    for seed in range(40):
        dice = np.random.default_rng((3, seed))
        seen += len(slow_powers(dice.normal(size=3000) + 0.01 * np.cumsum(dice.normal(size=3000)), 1.0).lines)
    assert seen <= 1


def test_a_gauss_markov_process_is_found_with_its_time_and_driving_noise() -> None:
    dice, rate, time_s, sigma = np.random.default_rng(4), 20.0, 30.0, 4.0 * WALK
    keep = np.exp(-1.0 / rate / time_s)
    n = int(7200 * rate)
    drive = sigma * np.sqrt(1.0 - keep**2) * dice.standard_normal(n + 10_000)
    slow = lfilter([1.0], [1.0, -keep], drive)[10_000:]
    found = channel(Record(white(dice, n, rate) + slow, rate))
    process = found.correlated
    assert abs(process.time_s - time_s) < SIGMAS * process.time_sd_s
    assert abs(process.driving - sigma * np.sqrt(2.0 / time_s)) < SIGMAS * process.driving_sd
    assert found.coefficient("bias_instability").likelihood.value is None
    assert any("Gauss–Markov process is in the noise" in sentence for sentence in found.warnings)


def test_a_drift_that_a_temperature_explains_is_its_slope() -> None:
    record = FOREIGN["temperature"](np.random.default_rng(5))
    found = channel(record)
    followed = found.temperature
    assert abs(followed.slope - record.truth["slope"]) < SIGMAS * followed.standard_uncertainty
    assert found.coefficient("rate_random_walk").likelihood.value is None
    assert any("the rate follows temperature" in sentence for sentence in found.warnings)


def test_a_temperature_that_merely_wanders_explains_no_walk() -> None:
    """Two walks that have nothing to do with each other: at 1e-3 and a gain of 4, none of eight records follows."""
    for seed in range(8):
        dice = np.random.default_rng((6, seed))
        n = 20 * 3600
        y = white(dice, n, 20.0) + walk(dice, n, 20.0, WALK / 30.0)
        found = channel(Record(y, 20.0, temperature_c=25.0 + walk(dice, n, 20.0, 0.01)))
        assert found.temperature is None
        assert found.coefficient("rate_random_walk").likelihood.value is not None


def test_a_shift_of_the_level_is_placed_and_is_no_walk() -> None:
    dice, rate, n = np.random.default_rng(7), 50.0, 50 * 3000
    y = white(dice, n, rate)
    y[60_000:] += 2.0 * WALK
    found = channel(Record(y, rate))
    assert abs(found.shift.height - 2.0 * WALK) < SIGMAS * found.shift.standard_uncertainty
    assert found.shift.at_s == pytest.approx(1200.0, abs=10.0)
    assert found.coefficient("rate_random_walk").likelihood.value is None


def test_a_plain_counter_at_rest_has_a_limit_that_holds() -> None:
    """Ten counters are judged; a limit of 95 % that failed three times of ten would be none (1 %)."""
    held = 0
    for seed in range(10):
        record = counter(np.random.default_rng((8, seed)))
        found = channel(record)
        reading = found.coefficient("random_walk").likelihood
        assert reading.value is None
        assert not reading.described
        assert any("without dither" in sentence for sentence in found.warnings)
        held += reading.upper_limit >= record.truth["random_walk"]
    assert held >= 8


def test_a_resonance_is_left_out_and_the_rest_keeps_its_claims() -> None:
    """0.6 Hz, quality 10, a hundred times the white noise at its peak."""
    dice, rate, f0 = np.random.default_rng(9), 100.0, 0.6
    n = int(2400 * rate)
    radius = np.exp(-np.pi * f0 / 10.0 / rate)
    a = [1.0, -2.0 * radius * np.cos(2.0 * np.pi * f0 / rate), radius**2]
    turn = 2.0 * np.pi * f0 / rate
    gain = 10.0 * abs(np.polyval(a, np.exp(1j * turn))) / (2.0 * np.sin(turn))
    y = white(dice, n, rate) + lfilter([gain, 0.0, -gain], a, white(dice, n, rate))
    found = channel(Record(y, rate))
    reading = found.coefficient("random_walk").likelihood
    assert abs(reading.value - WALK) < SIGMAS * reading.standard_uncertainty
    for process in ("quantization", "bias_instability", "rate_random_walk"):
        assert found.coefficient(process).likelihood.value is None
    assert found.warnings


def test_a_record_keeps_what_a_counter_without_dither_does_not_tell() -> None:
    """A known N stays; where nothing was known, the record has the limit, never zero."""
    (summary,) = analysed(counter(np.random.default_rng((8, 0)))).channels
    limit = summary.mean("random_walk").values[0].upper_limit
    assert summary.noise_over(NoiseCoefficients(random_walk=0.25)).random_walk == 0.25
    assert summary.noise_over(None).random_walk == limit > 0.0
