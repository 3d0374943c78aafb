"""The engine of the Allan family: against allantools, the thesis's script and brute force; streams, gaps, refusals."""

import warnings
from math import comb

import numpy as np
import pytest

from procedures.analysis.allan import deviation as deviation_module
from procedures.analysis.allan import overlapping
from procedures.analysis.allan.correlated import Uncorrelatable
from procedures.analysis.allan.deviation import Deviation, DeviationStream, deviation
from procedures.analysis.allan.statistic import (
    ALLAN,
    MODIFIED_ALLAN,
    OVERLAPPING_ALLAN,
    OVERLAPPING_HADAMARD,
    STATISTICS,
    Statistic,
    log_sizes,
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


LONG_SIZES = [1, 2, 7, 60, 555, 2048, 2500, 4000, 16_000, 17_001, 40_000, 100_003, *range(20, 40)]


def angle_noise(statistic: Statistic, count: int) -> float:
    """Standard deviation of ln σ for the remainders' products that are left out of so many terms, white angle noise.

    σ² is a mean of terms with ``C(2d, d)`` squares; left out are products with the coefficients ``C(2d, d+j)``.
    """
    d = statistic.order
    return float(np.sqrt(sum(comb(2 * d, d + j) ** 2 for j in range(1, d + 1)) / count) / comb(2 * d, d))


@pytest.mark.parametrize("correlate", [True, False], ids=["correlated", "term by term"])
@each_statistic
def test_a_long_series_in_two_resolutions(
    statistic: Statistic, correlate: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against every start of the same series: rounding where exact, 0.1 % where not.

    The limits are lowered so that 600 000 samples are long. White angle noise rules up to 3·2² = 12 samples only.
    """
    y = mixture(600_000, walk=3e-5)
    with monkeypatch.context() as lowered:
        lowered.setattr(deviation_module, "WHOLE", 1 << 18)
        lowered.setattr(overlapping, "WHOLE", 1 << 18)
        lowered.setattr(overlapping, "POINTS", 1 << 17)
        ours = streamed(y, 400.0, statistic, 11, sizes=LONG_SIZES, correlate=correlate)
    every = deviation(y, 400.0, statistic, sizes=ours.sizes)
    exact = ours.strides == 1
    assert ours.deviation[exact] == pytest.approx(every.deviation[exact], rel=1e-8)
    assert np.array_equal(ours.terms[exact], every.terms[exact])
    assert ours.deviation == pytest.approx(every.deviation, rel=1e-3)
    assert np.array_equal(ours.alpha, every.alpha)
    assert statistic.overlapping == bool(np.any(~exact))
    assert np.array_equal(ours.left_out, np.zeros(len(ours.sizes)))
    assert np.abs(ours.sizes / np.unique(LONG_SIZES) - 1).max() < 5e-3


@pytest.mark.parametrize("statistic", [OVERLAPPING_ALLAN, OVERLAPPING_HADAMARD], ids=lambda s: s.name)
@pytest.mark.parametrize("kind", ["white angle", "flicker angle", "white", "flicker", "random walk", "bursts"])
def test_what_the_block_means_leave_out_is_no_more_than_is_said(
    kind: str, statistic: Statistic, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Five standard deviations of the worst case, white angle noise alone; where the rate is white or redder 10⁻⁴."""
    y = long_noise(kind, 600_000)
    monkeypatch.setattr(deviation_module, "WHOLE", 1 << 18)
    # Bursts are weighted by how much of them a cluster's starts see, known to a window of 61 440 samples.
    sizes = [2080, 3008, 6400, 20_000, 60_000, 150_016][: 4 if kind == "bursts" else 6]
    ours = streamed(y, 400.0, statistic, 3, sizes=sizes)
    monkeypatch.setattr(deviation_module, "WHOLE", 1 << 21)
    every = deviation(y, 400.0, statistic, sizes=ours.sizes)
    assert (ours.strides > 1).all()
    off = np.abs(np.log(ours.deviation / every.deviation))
    allowed = 5.0 * np.array([angle_noise(statistic, len(y) - statistic.order * int(m)) for m in ours.sizes])
    assert (off < (allowed if "angle" in kind or kind == "bursts" else 1e-4)).all(), off


def long_noise(kind: str, count: int) -> np.ndarray:
    """A rate of one kind, (count,); "bursts": white angle noise ten times as strong in the middle third."""
    rng = np.random.default_rng(3)
    white = rng.normal(size=count + 1)
    match kind:
        case "white angle":
            return np.diff(white)
        case "bursts":
            white[count // 3 : count // 3 * 2] *= 10.0
            return np.diff(white)
        case "random walk":
            return np.cumsum(white)
        case "white":
            return white
    spectrum = np.fft.rfft(white)
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    flicker = np.fft.irfft(spectrum, count)
    return np.diff(flicker) if kind == "flicker angle" else flicker


def test_a_line_that_rules_is_differenced_term_by_term(monkeypatch: pytest.MonkeyPatch) -> None:
    """The residue of a dither: the fast sums forget its phase, so they refuse, and `deviation` goes the long way."""
    monkeypatch.setattr(deviation_module, "WHOLE", 1 << 18)
    count = 600_000
    y = np.random.default_rng(1).normal(size=count) + np.diff(100.0 * np.sin(1.9 * np.arange(count + 1)))
    with pytest.raises(Uncorrelatable, match="periodic"):
        streamed(y, 400.0, OVERLAPPING_ALLAN, 3, sizes=[1, 5000])
    ours = deviation(y, 400.0, sizes=[1, 5000])
    monkeypatch.setattr(deviation_module, "WHOLE", 1 << 21)
    assert ours.deviation == pytest.approx(deviation(y, 400.0, sizes=[1, 5000]).deviation, rel=1e-9)


def test_a_series_that_wanders_far_is_differenced_term_by_term(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(deviation_module, "WHOLE", 1 << 17)
    noise, ramp = mixture(300_000), np.linspace(0.0, 1e7, 300_000)
    fast, slow = (streamed(noise + ramp / 100, 400.0, OVERLAPPING_ALLAN, 3, sizes=[1, 29], correlate=c) for c in (1, 0))
    assert fast.deviation == pytest.approx(slow.deviation, rel=1e-5)
    y = noise + ramp
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
    stream = DeviationStream(1.0, 200)
    stream.add(y)
    with pytest.raises(UnfitRecording, match="100 samples came where 200"):
        stream.finish()


def test_default_sizes_are_log_spaced() -> None:
    sizes = log_sizes(4_320_000)
    assert (sizes[0], sizes[-1]) == (1, 4_320_000)
    assert np.all(np.diff(sizes) > 0)
