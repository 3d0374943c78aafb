"""The covariance of station means against hand-worked numbers, direct integration and a time-domain simulation."""

import numpy as np
import pytest
from scipy.integrate import quad

from procedures.analysis.calibration.station_noise import mean_covariance, triad_covariance
from procedures.core.noise import NoiseCoefficients
from procedures.core.unit import TriadRecord

WINDOWS = np.array([[10.0, 80.0], [90.0, 160.0], [400.0, 500.0]])


def test_white_and_quantization_noise_by_hand():
    covariance = mean_covariance(NoiseCoefficients(quantization=7.0, random_walk=2.0), WINDOWS)
    # 2·7²/70² + 2²/70 = 0.02 + 0.0571428…; 2·7²/100² + 2²/100 = 0.0098 + 0.04
    assert np.diagonal(covariance) == pytest.approx([0.07714285714, 0.07714285714, 0.0498])
    assert np.count_nonzero(covariance) == 3


def test_rate_random_walk_by_hand():
    covariance = mean_covariance(NoiseCoefficients(rate_random_walk=1.0), WINDOWS)
    # From launch: variance of a mean a + T/3; two disjoint windows share all that came before the middle of the first.
    assert np.diagonal(covariance) == pytest.approx([10 + 70 / 3, 90 + 70 / 3, 400 + 100 / 3])
    assert covariance[0, 1:] == pytest.approx([45.0, 45.0])
    assert covariance[1, 2] == pytest.approx(125.0)


def test_rate_ramp_is_one_unknown_slope():
    covariance = mean_covariance(NoiseCoefficients(rate_ramp=0.5), WINDOWS)
    middles = np.array([45.0, 125.0, 450.0])
    assert covariance == pytest.approx(0.25 * np.outer(middles, middles))


def flicker_correlation(lag: float, band: tuple[float, float]) -> float:
    """(1/π)·∫exp(−lag/τ) d ln τ over the band, by adaptive quadrature, for B = 1."""
    return quad(lambda u: np.exp(-lag * np.exp(-u)), *np.log(band), epsabs=1e-11)[0] / np.pi


@pytest.mark.parametrize("band", [(0.5, 1.0e5), (5.0, 300.0)])
def test_flicker_against_direct_integration(band: tuple[float, float]):
    covariance = mean_covariance(NoiseCoefficients(bias_instability=1.0, flicker_band_s=band), WINDOWS)
    # A window against itself: (2/T²)∫(T − x)·r(x)dx. Two of equal length T, d apart: (1/T²)∫(T − |x|)·r(d + x)dx.
    own = quad(lambda x: 2 / 4900 * (70 - x) * flicker_correlation(x, band), 0, 70, epsabs=1e-8, limit=200)[0]
    both = quad(lambda x: (70 - abs(x)) / 4900 * flicker_correlation(80 + x, band), -70, 70, points=[0], epsabs=1e-8)[0]
    assert covariance[0, 0] == pytest.approx(own, rel=1e-6)
    assert covariance[0, 1] == pytest.approx(both, rel=1e-6)
    assert np.linalg.eigvalsh(covariance).min() > 0


def test_flicker_against_a_time_domain_simulation():
    rng = np.random.default_rng(7)
    step, units_, low, high = 0.5, 400, 2.0, 5000.0
    u = (np.arange(40) + 0.5) / 40 * np.log(high / low) + np.log(low)
    tau, variance = np.exp(u), np.log(high / low) / 40 / np.pi
    decay = np.exp(-step / tau)
    state = rng.normal(size=(units_, 40)) * np.sqrt(variance)
    sums = np.zeros((units_, 3))
    for k in range(1000):
        inside = (WINDOWS[:, 0] <= k * step) & (k * step < WINDOWS[:, 1])
        sums += state.sum(axis=1)[:, None] * inside
        state = state * decay + rng.normal(size=state.shape) * np.sqrt(variance * (1 - decay**2))
    means = sums / ((WINDOWS[:, 1] - WINDOWS[:, 0]) / step)
    claimed = mean_covariance(NoiseCoefficients(bias_instability=1.0, flicker_band_s=(low, high)), WINDOWS)
    # A sample covariance of 400 has a relative error of √(2/400) = 7 %; four of them.
    assert np.cov(means.T) == pytest.approx(claimed, rel=0.28)


def test_flicker_ties_stations_together():
    covariance = mean_covariance(NoiseCoefficients(bias_instability=1.0), WINDOWS)
    assert 0.5 < covariance[0, 1] / covariance[0, 0] < 1.0


def test_an_unknown_noise_is_not_taken_for_none():
    silent = NoiseCoefficients()
    assert triad_covariance(None, WINDOWS) is None
    assert triad_covariance(TriadRecord((silent, silent, NoiseCoefficients(random_walk=1.0))), WINDOWS) is None


@pytest.mark.parametrize("bad", [[[0.0, 0.0]], [[-1.0, 5.0]], [[0.0, np.nan]]])
def test_windows_must_have_a_length(bad: list[list[float]]):
    with pytest.raises(ValueError, match="start < stop"):
        mean_covariance(NoiseCoefficients(random_walk=1.0), bad)
