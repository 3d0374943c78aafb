"""Several statistics in one pass against each by itself: exact sizes to rounding, the others within their claim."""

import numpy as np
import pytest

from procedures.analysis.allan import correlated, deviation, family
from procedures.analysis.allan.family import deviations
from procedures.analysis.allan.statistic import MODIFIED_ALLAN, STATISTICS, TIME, log_sizes
from procedures.core.errors import BadParameter, UnfitRecording

COUNT, RATE_HZ = 150_000, 50.0


def record() -> np.ndarray:
    rng = np.random.default_rng(7)
    return rng.normal(size=COUNT) + np.diff(rng.normal(0.0, 5.0, COUNT + 1))


@pytest.mark.parametrize("whole", [COUNT, 1000])
@pytest.mark.parametrize("increments", [False, True])
def test_each_is_what_it_is_by_itself(monkeypatch: pytest.MonkeyPatch, whole: int, increments: bool) -> None:
    for module in (deviation, family):  # the fast sums serve long series: this one is taken for long
        monkeypatch.setattr(module, "WHOLE", whole)
    y, every = record(), {statistic: log_sizes(statistic.largest(COUNT), 40) for statistic in STATISTICS.values()}
    found = deviations(y, RATE_HZ, every, increments=increments)
    assert list(found) == list(every)
    for statistic, ours in found.items():
        alone = deviation.deviation(y, RATE_HZ, statistic, sizes=every[statistic], increments=increments)
        exact = alone.strides == 1
        for name in ("deviation", "lower", "upper", "tau_s", "edf"):
            one, other = getattr(ours, name), getattr(alone, name)
            np.testing.assert_allclose(one[exact], other[exact], rtol=1e-9, err_msg=f"{statistic.name} {name}")
            # What both claim of the approximate sizes is 0.1 %; they differ by the windows of the remainders alone.
            np.testing.assert_allclose(one[~exact], other[~exact], rtol=1e-3, err_msg=f"{statistic.name} {name}")
        np.testing.assert_array_equal(ours.sizes, alone.sizes)
        np.testing.assert_array_equal(ours.terms, alone.terms)
    assert {statistic.name for statistic, ours in found.items() if np.any(ours.strides > 1)} <= {
        statistic.name for statistic in every if statistic.overlapping
    }


def test_a_time_deviation_of_sizes_of_its_own_is_found_for_itself() -> None:
    y, sizes = record(), {MODIFIED_ALLAN: np.array([1, 7]), TIME: np.array([2, 9])}
    found = deviations(y, RATE_HZ, sizes)
    np.testing.assert_array_equal(found[TIME].sizes, [2, 9])
    one = deviation.deviation(y, RATE_HZ, MODIFIED_ALLAN, sizes=[2, 9])
    np.testing.assert_allclose(found[TIME].deviation, one.deviation * one.tau_s / np.sqrt(3.0), rtol=1e-12)


def test_one_that_the_fast_sums_cannot_do_is_differenced_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (deviation, family):
        monkeypatch.setattr(module, "WHOLE", 1000)
    monkeypatch.setattr(correlated, "ROUNDING", 0.0)  # no rounding is small enough
    y, every = record(), {statistic: np.array([1, 20, 300]) for statistic in STATISTICS.values()}
    found = deviations(y, RATE_HZ, every)
    for statistic, ours in found.items():
        alone = deviation.deviation(y, RATE_HZ, statistic, sizes=every[statistic])
        np.testing.assert_allclose(ours.deviation, alone.deviation, rtol=1e-12)


def test_what_one_refuses_all_refuse() -> None:
    y = record()
    y[3] = np.nan
    with pytest.raises(UnfitRecording, match="sample 3"):
        deviations(y, RATE_HZ, {TIME: np.array([1])})
    with pytest.raises(BadParameter, match="sizes"):
        deviations(record(), RATE_HZ, {TIME: np.array([COUNT])})
