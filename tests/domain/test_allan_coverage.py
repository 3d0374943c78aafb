"""The judge of the intervals' coverage; the Monte Carlo itself is ``python -m tests.validation.allan``."""

from dataclasses import replace

import pytest

from procedures.analysis.allan.confidence_intervals import ONE_SIGMA
from procedures.analysis.allan.statistic import HADAMARD, MODIFIED_ALLAN, OVERLAPPING_ALLAN
from tests.validation.allan_coverage import COUNT, coverages, failures, limits, true_deviation


def test_the_truth_is_that_of_the_closed_forms() -> None:
    """White rates 1/√m; unit white readings six (Hadamard 20) squares over 2m² (6m²), if modified of means of m."""
    for m in (1, 8, 100):
        assert true_deviation(0, OVERLAPPING_ALLAN, m) == pytest.approx(m**-0.5, rel=1e-3)
        assert true_deviation(0, HADAMARD, m) == pytest.approx(m**-0.5, rel=1e-3)
        assert true_deviation(2, OVERLAPPING_ALLAN, m) == pytest.approx(3**0.5 / m, rel=1e-3)
        assert true_deviation(2, MODIFIED_ALLAN, m) == pytest.approx(3**0.5 / m**1.5, rel=1e-3)
        assert true_deviation(2, HADAMARD, m) == pytest.approx((10 / 3) ** 0.5 / m, rel=1e-3)


def test_the_judge_accepts_white_noise_and_refuses_intervals_that_are_too_narrow() -> None:
    rows = coverages(0, 100)
    assert failures(rows) == []
    # Of 100 records, 68 % are known to 4.7 %: half as many again or fewer is nine of them.
    narrow = [replace(row, covered=(row.covered[0] / 2, row.covered[1] / 2)) for row in rows]
    assert len(failures(narrow)) == 2 * len(rows)


def test_tolerances_shrink_with_the_sample() -> None:
    """350 checks of two sides share 10⁻³: 4.67 binomial standard deviations of √(0.683·0.317/n)."""
    low, high = limits(0, OVERLAPPING_ALLAN, 4, ONE_SIGMA, 10_000)
    assert (low, high) == pytest.approx((ONE_SIGMA - 0.0217, ONE_SIGMA + 0.0217), abs=0.001)
    wide_low, wide_high = limits(0, OVERLAPPING_ALLAN, COUNT // 4, ONE_SIGMA, 10_000)
    assert wide_low == low
    assert wide_high > high + 0.05
