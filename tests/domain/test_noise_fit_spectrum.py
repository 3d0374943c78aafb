"""Spectra for the noise coefficients: expected powers against brute force and integrals, lines, degrees of freedom."""

from math import inf, log, pi

import numpy as np
import pytest
from scipy.fft import dct
from scipy.linalg import toeplitz
from scipy.stats import chi2

from procedures.analysis.noise_fit.bands import agreed
from procedures.analysis.noise_fit.columns import (
    BIAS_INSTABILITY,
    cosine_powers,
    covariances,
    sine_edged_taper,
    tapered_powers,
)
from procedures.analysis.noise_fit.powers import FastPowers, slow_powers
from procedures.analysis.noise_fit.restricted import information, state
from procedures.analysis.noise_fit.selection import ENDS
from procedures.core.errors import BadParameter, UnfitRecording
from tests.validation.noise_records import ACCELEROMETER, Scenario, density, gyro

CASES = [(40, 1.0, (0.5, 1e5)), (33, 0.25, (0.0, inf)), (48, 0.0025, (0.5, 1e5))]


@pytest.mark.parametrize(("n", "cell_s", "band_s"), CASES)
def test_expected_powers_are_those_of_the_covariance_matrix(n: int, cell_s: float, band_s: tuple[float, float]) -> None:
    """``diag(T Γ T*)`` with the whole matrices; mode 0 is not used, a constant is lost in the others."""
    gamma = covariances(n, cell_s, band_s)
    cosines = dct(np.eye(n), norm="ortho", axis=0)
    taper = sine_edged_taper(n, 5)
    waves = taper * np.exp(-2j * np.pi * np.outer(np.arange(n // 2 + 1), np.arange(n)) / n)
    waves -= np.outer(waves.sum(axis=1), taper) / taper.sum()
    for row, plain, tapered in zip(gamma, cosine_powers(gamma), tapered_powers(gamma, taper), strict=True):
        for constant in (0.0, 7.0):
            matrix = toeplitz(row + constant * row[0])
            np.testing.assert_allclose(plain, np.diag(cosines @ matrix @ cosines.T)[1:], rtol=1e-9)
            np.testing.assert_allclose(tapered[1:], np.diag(waves @ matrix @ waves.conj().T).real[1:], rtol=1e-9)


def test_neighbouring_cells_have_the_allan_variance_of_each_process() -> None:
    """γ(0) − γ(1) at Δ = 2 s: 3/Δ², 1/Δ, 2 ln 2/π (unlimited band) and Δ/3 (IEEE Std 952 Annex C)."""
    gamma = covariances(5, 2.0, (0.0, inf))
    np.testing.assert_allclose(gamma[:, 0] - gamma[:, 1], [0.75, 0.5, 2.0 * log(2.0) / pi, 2.0 / 3.0], rtol=1e-12)


@pytest.mark.parametrize("lag", [1, 5, 63, 64, 1000])
def test_the_flicker_has_the_density_of_the_definition(lag: int) -> None:
    """``γ(0) − γ(l) = ∫ S(f) sinc² (1 − cos 2πfl) df`` over the density of `core.noise`; Δ = 1 s.

    To 1e-5: the covariance takes the longest relaxation time's part at a cell's middle, an error of Δ/τ₂ = 1e-5.
    """
    f = np.geomspace(1e-9, 300.0, 2_000_001)
    one_sided = 2.0 / (pi**2 * f) * (np.arctan(2e5 * pi * f) - np.arctan(pi * f))
    integral = np.trapezoid(one_sided * np.sinc(f) ** 2 * (1.0 - np.cos(2.0 * pi * f * lag)) * f, np.log(f))
    gamma = covariances(1001, 1.0, (0.5, 1e5))[BIAS_INSTABILITY]
    assert gamma[0] - gamma[lag] == pytest.approx(float(integral), rel=1e-5)


def dense_bound(scenario: Scenario, n: int) -> np.ndarray:
    """Cramér-Rao bound of ln(squares) from n cells of 1 s, (p,), by the matrices of first differences of the cells.

    Their covariance is integrated from the closed-form density: ``c(l) = 2∫ S(f)·4 sin²(πf)·cos(2πfl) df``.
    """
    f = np.concatenate([np.geomspace(1e-9, 1e-4, 2000), np.linspace(1e-4, 0.5, 10_001)[1:]])
    _, rows = density(scenario, f, 1.0)
    waves = 4.0 * np.sin(pi * f) ** 2 * np.cos(2.0 * pi * f * np.arange(n - 1)[:, None])
    parts = [toeplitz(2.0 * np.trapezoid(waves * row, f, axis=1)) for row in rows]
    inverse = np.linalg.inv(sum(parts))
    scaled = [inverse @ part for part in parts]
    return np.linalg.inv([[0.5 * np.sum(a * b.T) for b in scaled] for a in scaled]).diagonal()


@pytest.mark.parametrize(
    "scenario",
    [
        ACCELEROMETER,
        Scenario("Q, N", 0.1, gyro(0.39, 0.01)),
        Scenario("N, K", 0.1, gyro(0.0, 0.0014, 0.0, 0.3)),
        Scenario("N, B", 0.1, gyro(0.0, 0.0014, 0.1)),
    ],
    ids=lambda s: s.title,
)
def test_the_information_is_that_of_the_whole_gaussian_record(scenario: Scenario) -> None:
    """240 cells, the bound by 239 × 239 matrices: taking the modes for independent costs or feigns less than 5 %."""
    n = 240
    cells = np.random.default_rng(1).normal(size=n)
    spectrum = agreed(slow_powers(cells, 1.0), None).joined.used.only(ENDS)
    squares = np.array([scenario.of(p) ** 2 for p in ("quantization", "random_walk", "bias_instability")])
    squares = np.append(squares, scenario.of("rate_random_walk") ** 2)
    free = np.flatnonzero(squares)
    at = state(spectrum, squares)
    claimed = np.linalg.inv(information(spectrum, at)[np.ix_(free, free)]).diagonal() / squares[free] ** 2
    np.testing.assert_allclose(np.sqrt(claimed / dense_bound(scenario, n)), 1.0, atol=0.05)


def fast_powers(y: np.ndarray, block: int) -> FastPowers:
    stream = FastPowers(100.0, 0.4)
    for i in range(0, len(y), block):
        stream.add(y[i : i + block])
    return stream


def test_blocks_do_not_matter() -> None:
    y = np.random.default_rng(2).normal(size=20_000)
    whole, parts = fast_powers(y, len(y)).finish(), fast_powers(y, 77).finish()
    np.testing.assert_array_equal(whole.power, parts.power)


def test_white_noise_has_the_stated_power_and_degrees_of_freedom() -> None:
    """Σ dof·(P/S − 1)²/2 is χ² with as many degrees of freedom as bins, within its 1e-4 quantiles, and has no line."""
    powers = fast_powers(np.random.default_rng(3).normal(size=2_000_000), 100_000).finish()
    expected = powers.columns[:, 1] * 0.01  # N² = s²Δ
    deviate = (powers.power / expected - 1.0) * np.sqrt(0.5 * powers.dof)
    assert chi2.ppf(1e-4, len(deviate)) < np.sum(deviate**2) < chi2.isf(1e-4, len(deviate))
    assert powers.lines == ()


def test_a_line_is_cut_out_and_told() -> None:
    """A sine of 0.05 in white noise of 1: 0.05²·1024/4 = 0.64 in its modes, where a mean of 2000 segments has 0.02."""
    rng = np.random.default_rng(4)
    t = np.arange(2_000_000) / 100.0
    plain = rng.normal(size=len(t))
    powers = fast_powers(plain + 0.05 * np.sin(2.0 * pi * 30.0 * t), 100_000).finish()
    assert [line.frequency_hz for line in powers.lines] == pytest.approx([30.0], abs=0.1)
    # The noise of its five to seven modes, √7·0.02 = 0.053 of 0.64, is 4 % of the amplitude.
    assert powers.lines[0].amplitude == pytest.approx(0.05, rel=4 * 0.04)
    clean = fast_powers(plain, 100_000).finish()
    assert np.max(powers.power) < np.max(clean.power) * 1.05


def test_what_is_no_measurement_is_refused() -> None:
    y = np.random.default_rng(5).normal(size=100)
    broken = y.copy()
    broken[7] = np.nan
    with pytest.raises(UnfitRecording, match="sample 7"):
        slow_powers(broken, 1.0)
    stream = FastPowers(100.0, 0.4)
    stream.add(y)
    with pytest.raises(UnfitRecording, match="sample 107"):
        stream.add(broken)
    with pytest.raises(UnfitRecording, match="less than one segment"):
        stream.finish()
    with pytest.raises(UnfitRecording, match="constant"):
        slow_powers(np.full(100, 0.1), 1.0)
    with pytest.raises(UnfitRecording, match="too few"):
        slow_powers(y[:5], 1.0)
    with pytest.raises(BadParameter, match="crossover_hz"):
        FastPowers(100.0, 30.0)
    with pytest.raises(BadParameter, match="flicker_band_s"):
        slow_powers(y, 1.0, flicker_band_s=(2.0, 1.0))
    with pytest.raises(BadParameter, match="cell_s"):
        slow_powers(y, 0.0)
