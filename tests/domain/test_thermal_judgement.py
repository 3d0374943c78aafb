"""3σ, soaks and |ĝ| by hand; the correlation test under noise of known kind, where Student's would be fooled."""

import numpy as np
import pytest
from scipy.stats import binom, kstest, norm, pearsonr

from procedures.analysis.thermal.correlation import correlation
from procedures.analysis.thermal.judgement import Soak, magnitude, nearest, soaks, three_sigma
from procedures.analysis.thermal.runs import ThermalRun
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.noise import NoiseCoefficients
from procedures.core.thermal_correction import AxisCorrection, ThermalCorrection

N, CELL_S = 512, 60.0
TEMPERATURE = 20.0 + 40.0 * np.sin(2 * np.pi * np.arange(N) / N) + 10.0 * np.cos(4 * np.pi * np.arange(N) / N)


def flicker(rng: np.random.Generator) -> np.ndarray:
    """Density 1/f between a run and a cell, made in the frequency domain of a record eight times as long."""
    f = np.fft.rfftfreq(8 * N)[1:]
    wave = (rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f))) / np.sqrt(f)
    return np.fft.irfft(np.concatenate([[0.0], wave]))[:N]


def test_white_noise_is_no_dependence_and_known_noise_gives_uniform_p_values() -> None:
    rng, count, level = np.random.default_rng(7), 80, 0.05
    found = [correlation(rng.standard_normal(N), TEMPERATURE, CELL_S) for _ in range(count)]
    assert sum(c.p_value < level for c in found) <= binom.isf(1e-3, count, level)
    white = NoiseCoefficients(random_walk=np.sqrt(CELL_S))
    known = [correlation(rng.standard_normal(N), TEMPERATURE, CELL_S, white) for _ in range(count)]
    assert kstest([c.p_value for c in known], "uniform").pvalue > 1e-3
    assert known[0].effective_samples == pytest.approx(N, rel=0.01)
    assert known[0].slope_sd == pytest.approx(1.0 / np.sqrt(np.sum((TEMPERATURE - TEMPERATURE.mean()) ** 2)), rel=1e-9)
    assert np.median([c.effective_samples for c in found]) > 0.7 * N  # the fitted noise is now and then not quite white


def test_flicker_noise_is_not_taken_for_a_dependence() -> None:
    rng, count, level = np.random.default_rng(8), 80, 0.05
    signals = [flicker(rng) for _ in range(count)]
    found = [correlation(s, TEMPERATURE, CELL_S) for s in signals]
    alarms = sum(c.p_value < level for c in found)
    assert alarms <= binom.isf(1e-3, count, level)
    fooled = sum(pearsonr(s, TEMPERATURE).pvalue < level for s in signals)
    assert fooled > 0.5 * count
    assert np.median([c.effective_samples for c in found]) < 20.0


def test_a_flicker_that_is_only_just_visible_does_not_alarm_too_often() -> None:
    # As gyros have it in thesis table 4.1: it passes the white noise at periods of 2.4 h, a few cosines of a run.
    rng, count, level = np.random.default_rng(10), 150, 0.05
    f = np.fft.rfftfreq(8 * N)[1:]
    found = []
    for _ in range(count):
        wave = (rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f))) * np.sqrt(1.0 + 1.0 / 144.0 / f)
        signal = np.fft.irfft(np.concatenate([[0.0], wave]))[:N]
        found.append(correlation(signal, TEMPERATURE, CELL_S))
    alarms = sum(c.p_value < level for c in found)
    assert alarms <= binom.isf(1e-3, count, level)
    # The normal test of the same slopes does: it takes the fitted noise for the true one.
    assert sum(abs(c.slope) > norm.isf(level / 2) * c.slope_sd for c in found) > alarms


def test_a_dependence_is_found_and_its_slope_told_with_its_uncertainty() -> None:
    rng = np.random.default_rng(9)
    found = [correlation(flicker(rng) + 3.0 * (TEMPERATURE - 20.0), TEMPERATURE, CELL_S) for _ in range(30)]
    z = (np.array([c.slope for c in found]) - 3.0) / np.array([c.slope_sd for c in found])
    assert max(c.p_value for c in found) < 1e-3
    assert np.abs(z).max() < 5.0
    assert (
        np.mean(z**2) < 2.6
    )  # chi-square of 30 reaches that, with 1.15 for the noise that is fitted, once in ten thousand
    assert min(c.r for c in found) > 0.5


def test_what_says_nothing_is_refused() -> None:
    with pytest.raises(UnfitRecording, match="constant"):
        correlation(np.zeros(N), TEMPERATURE, CELL_S)
    with pytest.raises(UnfitRecording, match="finite"):
        correlation(np.full(N, np.nan), TEMPERATURE, CELL_S)
    with pytest.raises(UnfitRecording, match="itself"):
        correlation(2.0 * TEMPERATURE, TEMPERATURE, CELL_S)
    with pytest.raises(UnfitRecording, match="too short"):
        correlation(np.random.default_rng(1).standard_normal(40), TEMPERATURE[:40], CELL_S)
    with pytest.raises(BadParameter, match="noise"):
        correlation(np.random.default_rng(1).standard_normal(N), TEMPERATURE, CELL_S, NoiseCoefficients())


def a_run() -> ThermalRun:
    """Two soaks of 20 cells at 20 and 60 °C with a ramp of ten between; x up; x reads 0.5 less at 60 °C."""
    case = np.concatenate([np.full(20, 20.0), np.linspace(24.0, 60.0, 10), np.full(20, 60.0)])
    dynamic = np.arange(50) // 10 == 2
    swing = np.where(np.arange(50) % 2, 0.01, -0.01)
    output = np.column_stack([10.0 - 0.0125 * (case - 20.0) + swing, np.zeros(50), np.zeros(50)])
    return ThermalRun(0, CELL_S, output, case, case, dynamic, (10.0, 0.0, 0.0))


IDEAL = AxisCorrection(1.0, 0.0)
CORRECTION = ThermalCorrection("accelerometer", (AxisCorrection(1.0, 0.0, beta=(0.0125, 0.0, 0.0, 0.0)), IDEAL, IDEAL))


def test_soaks_are_the_long_static_stretches() -> None:
    run = a_run()
    assert soaks(run) == (Soak(0, 20, 20.0), Soak(30, 50, 60.0))
    assert soaks(run, 1201.0) == ()
    assert nearest(soaks(run), 56.0) == Soak(30, 50, 60.0)
    with pytest.raises(UnfitRecording, match="no soak within 8"):
        nearest(soaks(run), 40.0)
    with pytest.raises(BadParameter, match="least_s"):
        soaks(run, 0.0)


def test_three_sigma_by_hand() -> None:
    run = a_run()
    first, last = soaks(run)
    found = three_sigma(run, CORRECTION, first, last)
    # before: √(0.5² + 0.01²); after: the swing alone; the spread of ±0.01 with n − 1 is 0.01·√(20/19)
    np.testing.assert_allclose(found.before, [3 * np.sqrt(0.25 + 1e-4), 0, 0], atol=1e-12)
    np.testing.assert_allclose(found.after, [0.03, 0, 0], atol=1e-12)
    np.testing.assert_allclose(found.spread_before, [0.03 * np.sqrt(20 / 19), 0, 0], atol=1e-12)
    np.testing.assert_allclose(found.spread_after, found.spread_before, atol=1e-12)


def test_outputs_before_the_correction_are_told_as_specific_forces() -> None:
    scaled = ThermalCorrection("accelerometer", (AxisCorrection(2.0, 0.0), IDEAL, IDEAL))
    first, last = soaks(a_run())
    found = three_sigma(a_run(), scaled, first, last)
    assert found.before[0] == pytest.approx(2.0 * 3.0 * np.sqrt(0.25 + 1e-4))


def test_the_magnitude_is_that_of_all_three_axes() -> None:
    found = magnitude(a_run(), CORRECTION, 9.0)
    np.testing.assert_allclose(found.errors_m_s2, 1.0 + np.where(np.arange(50) % 2, 0.01, -0.01), atol=1e-12)
    assert found.rms_static_m_s2 == pytest.approx(0.01)
    assert found.rms_dynamic_m_s2 == pytest.approx(0.01)
