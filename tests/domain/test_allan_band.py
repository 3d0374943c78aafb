"""The band over all starts against brute force, and the random intervals against the band's mean."""

import numpy as np
import pytest

from procedures.analysis.allan import band
from procedures.analysis.allan.band import Band, BandStream
from procedures.core.errors import UnfitRecording


def walk(count: int) -> np.ndarray:
    rng = np.random.default_rng(4)
    return rng.normal(size=count) + np.cumsum(rng.normal(0.0, 0.003, count))


def banded(y: np.ndarray, pieces: int, **options) -> Band:
    stream = BandStream(10.0, len(y), **options)
    for block in np.array_split(y, pieces):
        stream.add(block)
    return stream.finish()


def brute_force(y: np.ndarray, m: int) -> np.ndarray:
    """The non-overlapping deviation from every start that leaves at least two clusters."""
    found = []
    for start in range(m):
        k = (len(y) - start) // m
        if k >= 2:
            means = y[start : start + k * m].reshape(k, m).mean(axis=1)
            found.append(np.sqrt(np.mean(np.diff(means) ** 2) / 2))
    return np.array(found)


def test_every_start_of_a_short_series() -> None:
    y = walk(700)
    ours = banded(y, 9, step=0.02)
    assert ours.sizes[-1] > 300
    for i, m in enumerate(ours.sizes):
        every = brute_force(y, int(m))
        assert ours.starts[i] == len(every)
        assert (ours.least[i], ours.mean[i], ours.greatest[i]) == pytest.approx(
            (every.min(), every.mean(), every.max()), rel=1e-10
        )
    assert ours.tau_s == pytest.approx(ours.sizes / 10.0)


def test_a_long_series_keeps_the_band(monkeypatch: pytest.MonkeyPatch) -> None:
    """With 2¹⁵ terms a size instead of 2²⁰ the scatter is 32^½ times that of the real thing: 0.5 % becomes 2.8 %."""
    monkeypatch.setattr(band, "WHOLE", 1 << 15)
    monkeypatch.setattr(band, "POINTS", 1 << 15)
    monkeypatch.setattr(band, "_CHUNK", 1 << 16)
    y = walk(400_000)
    ours = banded(y, 13, sizes=[1, 5, 60, 300, 1111, 1990, 3000, 10_000, 60_000])
    assert {1, 5, 60, 300, 1111, 1990} <= set(ours.sizes)
    x = np.concatenate([[0.0], np.cumsum(y)])
    for i, m in enumerate(ours.sizes):
        sums, terms = band.start_sums(x, int(m))
        every = np.sqrt(sums / terms / 2) / m
        assert (ours.least[i], ours.mean[i], ours.greatest[i]) == pytest.approx(
            (every.min(), every.mean(), every.max()), rel=0.028
        )


def test_gaps_and_constants_are_refused() -> None:
    with pytest.raises(UnfitRecording, match="constant"):
        banded(np.zeros(100), 1)
    with pytest.raises(UnfitRecording, match="sample 7 is missing"):
        banded(np.where(np.arange(100) == 7, np.nan, walk(100)), 2)
