"""Degrees of freedom against allantools, identification and interval coverage against noises of known kind."""

import warnings

import numpy as np
import pytest
from scipy import fft

from procedures.analysis.allan.confidence_intervals import degrees_of_freedom
from procedures.analysis.allan.deviation import deviation
from procedures.analysis.allan.statistic import (
    MODIFIED_ALLAN,
    OVERLAPPING_ALLAN,
    OVERLAPPING_HADAMARD,
    STATISTICS,
    Statistic,
)
from procedures.core.errors import BadParameter

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    allantools = pytest.importorskip("allantools")

COUNT = 1 << 11
EXPONENTS = (2, 1, 0, -1, -2)


def power_law(alpha: int, rng: np.random.Generator, count: int = COUNT) -> np.ndarray:
    """Rate of spectral density ∝ f^α, (count,): white noise shaped in frequency, a quarter of a longer record."""
    length = 4 * count
    spectrum = fft.rfft(rng.normal(size=length + 1))
    f = np.arange(len(spectrum)) / (length + 1)
    shape = np.zeros(len(f))
    # The sum of the noise, x, is shaped f^((α−2)/2) and sampled, as a unit would: its aliases are no issue here.
    shape[1:] = (2.0 * np.sin(np.pi * f[1:])) ** (alpha / 2.0 - 1.0)
    x = fft.irfft(spectrum * shape, length + 1)[: count + 1]
    return np.diff(x)


@pytest.mark.parametrize("statistic", STATISTICS.values(), ids=lambda s: s.name)
def test_degrees_of_freedom_equal_those_of_allantools(statistic: Statistic) -> None:
    """Two implementations of one algorithm; it has no case for white angle noise and few terms."""
    compared = 0
    for alpha in range(2, 1 - 2 * statistic.order + 1, -1):
        for m in (1, 2, 3, 10, 33, 100, 330):
            try:
                theirs = allantools.edf_greenhall(
                    alpha, statistic.order, m, 1001, statistic.overlapping, statistic.modified
                )
            except NotImplementedError:
                continue
            ours = degrees_of_freedom(statistic, alpha, m, 1000, averaged=True)
            assert ours == pytest.approx(theirs, rel=1e-9)
            compared += 1
    assert compared > 25


def test_white_noise_by_hand() -> None:
    """N − 1 differences of white rate at m = 1, neighbours correlated by −½: edf = M / (1 + ½(1 − 1/M)), M = N − 1."""
    m = 999
    assert degrees_of_freedom(OVERLAPPING_ALLAN, 0, 1, 1000) == pytest.approx(m / (1 + 0.5 * (1 - 1 / m)), rel=1e-9)
    # White angle noise, three terms of a cluster each: the covariances (4/6)² and (1/6)² of the second difference.
    assert degrees_of_freedom(OVERLAPPING_ALLAN, 2, 1, 4) == pytest.approx(
        3 / (1 + 2 * (2 / 3 * (4 / 6) ** 2 + 1 / 3 * (1 / 6) ** 2)), rel=1e-9
    )


def test_an_exponent_that_does_not_converge_is_refused() -> None:
    with pytest.raises(BadParameter, match="alpha"):
        degrees_of_freedom(OVERLAPPING_ALLAN, -3, 10, 1000)
    assert degrees_of_freedom(OVERLAPPING_HADAMARD, -3, 10, 1000) > 1


@pytest.mark.parametrize("alpha", EXPONENTS)
def test_the_noise_is_identified(alpha: int) -> None:
    """At m = 1 and 4, where at least 2048 points decide: r₁ scatters by 0.02, half a step of α is 0.1 and more."""
    rng = np.random.default_rng(10 + alpha)
    found = [deviation(power_law(alpha, rng, 4 * COUNT), 1.0, sizes=[1, 4]).alpha for _ in range(20)]
    assert np.mean(np.array(found) == alpha, axis=0).min() >= 0.9


@pytest.mark.parametrize("statistic", [OVERLAPPING_ALLAN, MODIFIED_ALLAN, OVERLAPPING_HADAMARD], ids=lambda s: s.name)
@pytest.mark.parametrize("alpha", EXPONENTS)
def test_intervals_cover_as_often_as_they_say(alpha: int, statistic: Statistic) -> None:
    """120 records, the truth their root mean square; 68.3 % ± 4 binomial standard deviations of 4.2 %."""
    rng = np.random.default_rng(20 + alpha)
    results = [deviation(power_law(alpha, rng), 1.0, statistic, sizes=[1, 8, 64, 256]) for _ in range(120)]
    truth = np.sqrt(np.mean([r.deviation**2 for r in results], axis=0))
    covered = np.mean([(r.lower <= truth) & (truth <= r.upper) for r in results], axis=0)
    assert np.abs(covered - results[0].confidence).max() < 0.17, covered
