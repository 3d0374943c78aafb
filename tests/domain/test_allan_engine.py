"""The engine of the Allan family: against allantools, the thesis's script and brute force; streams, gaps, refusals."""

import warnings

import numpy as np
import pytest

from procedures.analysis.allan import overlapping
from procedures.analysis.allan.deviation import Deviation, DeviationStream, deviation
from procedures.analysis.allan.statistic import (
    ALLAN,
    MODIFIED_ALLAN,
    OVERLAPPING_ALLAN,
    STATISTICS,
    Statistic,
    log_sizes,
    sizes_of,
)
from procedures.core.errors import BadParameter, UnfitRecording

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    allantools = pytest.importorskip("allantools")

THEIRS = {
    "allan": allantools.adev,
    "overlapping_allan": allantools.oadev,
    "modified_allan": allantools.mdev,
    "time": allantools.tdev,
    "hadamard": allantools.hdev,
    "overlapping_hadamard": allantools.ohdev,
}
each_statistic = pytest.mark.parametrize("statistic", STATISTICS.values(), ids=lambda s: s.name)


def mixture(count: int, walk: float = 0.003) -> np.ndarray:
    """Rate with white angle noise, white rate and a random walk, (count,)."""
    rng = np.random.default_rng(1)
    angle = rng.normal(0.0, 2.0, count + 1)
    return 7.0 + rng.normal(size=count) + np.diff(angle) + np.cumsum(rng.normal(0.0, walk, count))


def streamed(y: np.ndarray, rate_hz: float, statistic: Statistic, pieces: int, **options) -> Deviation:
    stream = DeviationStream(rate_hz, len(y), statistic, **options)
    for block in np.array_split(y, pieces):
        stream.add(block)
    return stream.finish()


@each_statistic
def test_equal_to_allantools(statistic: Statistic) -> None:
    y = mixture(12_000)
    ours = deviation(y, 125.0, statistic)
    taus, theirs, _, terms = THEIRS[statistic.name](y, rate=125.0, data_type="freq", taus=ours.tau_s)
    same = np.isin(ours.sizes, np.round(taus * 125.0).astype(int))  # it leaves out sizes with a single term
    assert np.count_nonzero(same) > 100
    assert ours.deviation[same] == pytest.approx(theirs, rel=1e-12)
    assert np.array_equal(ours.terms[same], terms)


def test_equal_to_the_script_of_the_thesis() -> None:
    y = mixture(1500)
    ours = deviation(y, 1.0, ALLAN)
    spread = np.floor(np.exp(np.linspace(0.0, np.log(750), 200)))
    assert list(ours.sizes) == [*dict.fromkeys(spread[:-1].astype(int)), 750]
    for m, found in zip(ours.sizes, ours.deviation, strict=True):
        k = len(y) // m
        means = [sum(y[m * j : m * j + m]) / m for j in range(k)]
        assert found == pytest.approx(np.sqrt(np.sum(np.diff(means) ** 2) / (2 * (k - 1))), rel=1e-12)


@each_statistic
def test_blocks_of_any_length_give_the_same(statistic: Statistic, monkeypatch: pytest.MonkeyPatch) -> None:
    y = mixture(5_000)
    whole = deviation(y, 400.0, statistic)
    parts = streamed(y, 400.0, statistic, 37)
    # The reference that is taken off is the first block's mean: only rounding may differ.
    assert parts.deviation == pytest.approx(whole.deviation, rel=1e-11)
    assert np.array_equal(parts.terms, whole.terms)


def test_increments_and_counts_are_rates_over_the_period() -> None:
    counts = np.round(mixture(4_000) * 10.0).astype(np.int32)
    as_increments = deviation(counts, 400.0, increments=True)
    assert as_increments.deviation == pytest.approx(deviation(counts * 400.0, 400.0).deviation, rel=1e-12)


@each_statistic
def test_a_long_series_in_two_resolutions(statistic: Statistic, monkeypatch: pytest.MonkeyPatch) -> None:
    """Against every start of the same series: 1e-8 (the correlation's rounding) where exact, 0.1 % where thinned.

    The limits are lowered so that 600 000 samples are long. White angle noise rules up to 3·2² = 12 samples only.
    """
    y = mixture(600_000, walk=3e-5)
    sizes = [1, 2, 7, 60, 555, 4000, 16_000, 17_001, 40_000, 100_003, *range(20, 40)]
    with monkeypatch.context() as lowered:
        lowered.setattr(overlapping, "WHOLE", 1 << 18)
        lowered.setattr(overlapping, "POINTS", 1 << 17)
        lowered.setattr(overlapping, "FIRST_RUN", 1 << 16)
        lowered.setattr(overlapping, "RUN", 1 << 17)
        ours = streamed(y, 400.0, statistic, 11, sizes=sizes)
    every = deviation(y, 400.0, statistic, sizes=ours.sizes)
    exact = ours.strides == 1
    assert ours.deviation[exact] == pytest.approx(every.deviation[exact], rel=1e-8)
    assert np.array_equal(ours.terms[exact], every.terms[exact])
    assert ours.deviation == pytest.approx(every.deviation, rel=1e-3)
    assert statistic.overlapping == bool(np.any(~exact))
    assert np.array_equal(ours.left_out, np.zeros(len(ours.sizes)))
    assert np.abs(ours.sizes / np.unique(sizes) - 1).max() < 2e-3


def test_a_series_that_wanders_far_is_differenced_term_by_term(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(overlapping, "WHOLE", 1 << 17)
    monkeypatch.setattr(overlapping, "POINTS", 1 << 16)
    y = mixture(300_000) + np.linspace(0.0, 1e5, 300_000)
    with pytest.raises(UnfitRecording, match="correlate=False"):
        streamed(y, 400.0, OVERLAPPING_ALLAN, 3, sizes=range(1, 30))
    ours = deviation(y, 400.0, sizes=range(1, 30))
    assert ours.deviation[0] == pytest.approx(deviation(y[:100_000], 400.0, sizes=[1]).deviation[0], rel=0.01)


def brute_force(y: np.ndarray, m: int, statistic: Statistic) -> tuple[float, int]:
    """Mean square of all terms without a NaN, straight from cluster means."""
    d = statistic.order
    signs = np.diff(np.eye(d + 1), n=d - 1, axis=0)[0][:d] if d == 2 else np.array([1.0, -2.0, 1.0])
    last = len(y) - d * m
    starts = range(0, last + 1, 1 if statistic.overlapping else m)
    terms = [sum(s * np.mean(y[k + a * m : k + a * m + m]) for a, s in enumerate(signs)) for k in starts]
    if statistic.modified:
        terms = [np.mean(terms[k : k + m]) for k in range(len(terms) - m + 1)]
    good = [t for t in terms if not np.isnan(t)]
    return float(np.sqrt(np.mean(np.square(good)) / (2.0 if d == 2 else 6.0))), len(good)


@each_statistic
def test_terms_that_touch_a_gap_are_left_out_and_counted(statistic: Statistic) -> None:
    y = mixture(400)
    y[[0, 100, 101, 250]] = np.nan
    ours = streamed(y, 1.0, statistic, 7, sizes=[1, 3, 10, 40], gaps="aware")
    for i, m in enumerate(ours.sizes):
        expected, terms = brute_force(y, int(m), statistic)
        found = ours.deviation[i] * (np.sqrt(3.0) / m if statistic.is_time else 1.0)
        assert (found, ours.terms[i]) == (pytest.approx(expected, rel=1e-10), terms)
        assert ours.left_out[i] == statistic.starts(400, int(m)) - terms > 0
    assert (ours.missing, ours.first_missing) == (4, 0)


@pytest.mark.parametrize("statistic", [OVERLAPPING_ALLAN, MODIFIED_ALLAN], ids=lambda s: s.name)
def test_gaps_in_a_long_series(statistic: Statistic, monkeypatch: pytest.MonkeyPatch) -> None:
    y = mixture(400_000, walk=3e-5)
    y[[150_000, 150_001, 390_000]] = np.nan
    sizes = [1, 9, 200, 5000, 24_000, *range(10, 30)]
    every = deviation(y, 400.0, statistic, sizes=sizes, gaps="aware")
    monkeypatch.setattr(overlapping, "WHOLE", 1 << 18)
    monkeypatch.setattr(overlapping, "POINTS", 1 << 17)
    ours = streamed(y, 400.0, statistic, 5, sizes=sizes, gaps="aware")
    exact = ours.strides == 1
    assert ours.deviation[exact] == pytest.approx(every.deviation[exact], rel=1e-8)
    assert np.array_equal(ours.terms[exact], every.terms[exact])
    assert ours.deviation == pytest.approx(every.deviation, rel=1e-3)
    assert (ours.left_out > 0).all()


def test_a_gap_is_refused_by_its_index() -> None:
    y = mixture(1000)
    y[[321, 700]] = np.nan
    with pytest.raises(UnfitRecording, match="sample 321 is missing"):
        streamed(y, 1.0, OVERLAPPING_ALLAN, 10)
    y[321] = np.inf
    with pytest.raises(UnfitRecording, match="sample 321 is inf"):
        deviation(y, 1.0, gaps="aware")


def test_what_cannot_be_analysed_is_refused() -> None:
    y = mixture(100)
    with pytest.raises(UnfitRecording, match="constant"):
        deviation(np.full(100, 3.0), 1.0)
    with pytest.raises(UnfitRecording, match="10 samples are too few"):
        deviation(y[:10], 1.0)
    with pytest.raises(UnfitRecording, match="no cluster is whole"):
        deviation(np.where(np.arange(100) % 2, np.nan, y), 1.0, sizes=[1, 5], gaps="aware")
    with pytest.raises(BadParameter, match="1 to 50 samples"):
        deviation(y, 1.0, sizes=[1, 51])
    with pytest.raises(BadParameter, match="sizes"):
        deviation(y, 1.0, sizes=[0])
    with pytest.raises(BadParameter, match="rate_hz"):
        deviation(y, 0.0)
    with pytest.raises(BadParameter, match="confidence"):
        deviation(y, 1.0, confidence=1.0)
    with pytest.raises(BadParameter, match="one channel"):
        deviation(np.ones((50, 6)), 1.0)
    with pytest.raises(BadParameter, match="sample period"):
        sizes_of([0.001, 1.0], 400.0)
    stream = DeviationStream(1.0, 200)
    stream.add(y)
    with pytest.raises(UnfitRecording, match="100 samples came where 200"):
        stream.finish()


def test_default_sizes_are_log_spaced() -> None:
    sizes = log_sizes(4_320_000)
    assert (sizes[0], sizes[-1]) == (1, 4_320_000)
    assert np.all(np.diff(sizes) > 0)
