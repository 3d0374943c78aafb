"""Noise that the model does not describe, whole channels: the answer is right, or it says that it does not know.

Few records, intervals wider than the claimed 95 %; the shares over many: ``tests.validation.foreign_noise``.
"""

from typing import Any

import numpy as np
import pytest

from procedures.analysis.wavelet_split import wavelet_split
from tests.validation.foreign_noise import analysed
from tests.validation.foreign_records import FOREIGN, WALK, Record, white

FILTERED = [
    name for name in FOREIGN if "low-pass" in name or name in ("means of 2 to 5", "two rates: held", "interpolated")
]


def only_channel(record: Record) -> Any:
    return analysed(record).launches[0].channels[0]


@pytest.mark.parametrize("kind", FILTERED)
def test_filtered_noise_has_the_random_walk_of_its_low_frequencies(kind: str) -> None:
    """Two records a kind, 4.4 standard uncertainties (1e-5); what the filter takes away is no quantization."""
    for seed in (1, 2):
        channel = only_channel(FOREIGN[kind](np.random.default_rng(seed)))
        found = channel.coefficient("random_walk").likelihood
        assert abs(found.value - WALK) < 4.4 * found.standard_uncertainty
        assert channel.coefficient("quantization").likelihood.value is None
        assert any("it is left out" in sentence for sentence in channel.model)


@pytest.mark.parametrize("seconds", [120, 300, 900])
def test_a_short_record_is_split_into_the_levels_that_it_allows(seconds: int) -> None:
    channel = only_channel(Record(white(np.random.default_rng(3), seconds * 50, 50.0), 50.0))
    kept = next(stage for stage in channel.stages if stage.name == "kept by the wavelet split")
    allowed = int(np.log2(seconds / 15))  # PyWavelets: 2^levels·(filter − 1) cells, sym8 has 16 taps
    assert f"{allowed} levels, not 6" in kept.note
    assert channel.coefficient("random_walk").likelihood.value == pytest.approx(WALK, rel=0.1)


def test_a_wavelet_threshold_of_zero_leaves_a_series_of_rare_counts_as_it_is() -> None:
    """Median absolute deviation zero: unit noise zero, threshold zero, and no division by the size of a zero."""
    counts = np.zeros(2000)
    counts[[70, 900]] = 1.0, -1.0
    split = wavelet_split(counts, 1.0, rule="rescaled")
    assert np.all(np.isfinite(split.kept))
    np.testing.assert_allclose(split.kept, counts, atol=1e-5)
