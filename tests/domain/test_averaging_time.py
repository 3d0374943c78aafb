"""Where quantization falls below the rest: closed forms, the thesis's tables, and the spread of a Monte Carlo."""

from math import log, pi, sqrt

import numpy as np
import pytest

from procedures.analysis.averaging_time import AveragingTime, allan_variance, averaging_time, dwell
from procedures.core.errors import BadParameter
from procedures.core.noise import NoiseCoefficients


def test_each_rest_alone_has_a_closed_form() -> None:
    q = 0.4
    for noise, expected in (
        (NoiseCoefficients(q, random_walk=0.1), 3 * q**2 / 0.1**2),
        (NoiseCoefficients(q, bias_instability=0.02), q / 0.02 * sqrt(3 * pi / (2 * log(2)))),
        (NoiseCoefficients(q, rate_random_walk=1e-3), (9 * q**2 / 1e-6) ** (1 / 3)),
        (NoiseCoefficients(q, rate_ramp=1e-5), (6 * q**2 / 1e-10) ** 0.25),
    ):
        found = averaging_time(noise)
        assert found.tau_s == pytest.approx(expected, rel=1e-9)
        assert found.deviation == pytest.approx(sqrt(6) * q / expected, rel=1e-9)
        assert found.sd_s is None


def test_of_all_together_it_is_the_root_of_the_polynomial() -> None:
    noise = NoiseCoefficients(0.4, 0.1, 0.02, 1e-3, 1e-4)
    polynomial = [1e-8 / 2, 1e-6 / 3, 2 * log(2) / pi * 0.02**2, 0.01, -3 * 0.16]
    roots = np.roots(polynomial)
    real = roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real
    assert len(real) == 1
    assert averaging_time(noise).tau_s == pytest.approx(real[0], rel=1e-9)


def test_one_side_is_absent() -> None:
    assert averaging_time(NoiseCoefficients(random_walk=1.0)) == AveragingTime(0.0, None, None)
    assert averaging_time(NoiseCoefficients(quantization=1.0)).tau_s is None
    assert averaging_time(NoiseCoefficients()).tau_s is None


def test_uncertainty_is_that_of_a_monte_carlo() -> None:
    """4000 draws of correlated coefficients with 2 %: a standard deviation within 5·1.1 %, and 1 % of curvature."""
    mean = np.array([0.4, 0.1, 0.02, 1e-3, 1e-4])
    correlation = np.full((5, 5), 0.3) + 0.7 * np.eye(5)
    covariance = np.outer(0.02 * mean, 0.02 * mean) * correlation
    draws = np.random.default_rng(1).multivariate_normal(mean, covariance, 4_000)
    times = [averaging_time(NoiseCoefficients(*row)).tau_s for row in draws]
    found = averaging_time(NoiseCoefficients(*mean), covariance)
    assert found.sd_s == pytest.approx(float(np.std(np.array(times, dtype=float))), rel=0.065)


def test_small_numbers_in_si_change_nothing() -> None:
    covariance = np.diag([0.02, 0.01, 0.0, 0.0, 0.0]) ** 2
    big = averaging_time(NoiseCoefficients(0.4, 0.1), covariance)
    small = averaging_time(NoiseCoefficients(0.4e-9, 0.1e-9), covariance * 1e-18)
    assert (small.tau_s, small.sd_s) == pytest.approx((big.tau_s, big.sd_s), rel=1e-9)


def test_the_thesis_tables() -> None:
    """Worked by hand from the means of Tables 4.1 and 4.2, in arcsec and deg/h·√s, and µg.

    x: ``0.0071·τ + 1.13e-6·τ² = 0.456``. The thesis reads 55 s and 65 s on its plots; its coefficients say otherwise:
    46 to 102 s for the gyros, 38 s for the accelerometers. Two figures: what the tables print.
    """
    gyros = [(0.39, 0.0014, 0.0016), (0.26, 0.0011, 0.0017), (0.22, 0.0006, 0.0015)]
    times = [averaging_time(NoiseCoefficients(q, 60 * n, b)) for q, n, b in gyros]
    times.append(averaging_time(NoiseCoefficients(11.0, 0.0, 0.75)))
    assert [t.tau_s for t in times] == pytest.approx([64.0, 46.0, 102.0, 38.2], rel=0.02)
    assert dwell(times, 10.0) == 110.0


def test_a_dwell_is_the_longest_rounded_up() -> None:
    """Thesis 4.1.3: gyros 55 s, accelerometers 65 s, so 70 s."""
    channels = [AveragingTime(t, None, None) for t in (55.0, 65.0, 0.0)]
    assert dwell(channels, 10.0) == 70.0
    assert dwell(channels, 65.0) == 65.0
    assert dwell([AveragingTime(0.0, None, None)], 5.0) == 5.0
    assert dwell([*channels, AveragingTime(None, None, None)], 10.0) is None


def test_the_variance_is_the_sum_of_its_lines() -> None:
    noise = NoiseCoefficients(0.4, 0.1, 0.02, 1e-3, 1e-4)
    lines = [3 * 0.16 / 1e4, 0.01 / 100, 2 * log(2) / pi * 4e-4, 1e-6 * 100 / 3, 1e-8 * 1e4 / 2]
    assert allan_variance(noise, 100.0) == pytest.approx(sum(lines), rel=1e-12)


def test_what_makes_no_sense_is_refused() -> None:
    noise = NoiseCoefficients(1.0, 1.0)
    skewed = np.eye(5)
    skewed[0, 1] = 0.5
    for covariance in (np.eye(4), np.full((5, 5), np.nan), -np.eye(5), skewed, skewed * 1e-20):
        with pytest.raises(BadParameter, match="covariance"):
            averaging_time(noise, covariance)
    with pytest.raises(BadParameter, match="step_s"):
        dwell([averaging_time(noise)], 0.0)
    with pytest.raises(BadParameter, match="times"):
        dwell([], 10.0)
    with pytest.raises(BadParameter, match="tau_s"):
        allan_variance(noise, 0.0)
