"""Which samples of a stream are judged: the last of every ten seconds, however the stream is cut into blocks."""

import pytest

from procedures.analysis.thermal.profile_progress import CHECK_S, CheckedSamples


@pytest.mark.parametrize("sizes", [[1000], [1, 99, 100, 1, 0, 799], [7] * 142 + [6], [50] * 20])
def test_the_same_samples_are_judged_whatever_the_blocks(sizes: list[int]) -> None:
    checked, begin, found = CheckedSamples(10.0), 0, []
    for size in sizes:
        found += [(begin + row, t_s) for row, t_s in checked.of_block(size)]
        begin += size
    assert found == [(100 * k - 1, CHECK_S * k) for k in range(1, 11)]


def test_a_stream_slower_than_the_checks_is_judged_at_every_sample() -> None:
    assert CheckedSamples(0.01).of_block(3) == [(0, CHECK_S), (1, 2 * CHECK_S), (2, 3 * CHECK_S)]
