"""The fine transform about a slow line, beside `scipy.signal.zoom_fft`, which the analysis does not import."""

import numpy as np
import pytest
from scipy.signal import zoom_fft

from procedures.analysis.noise_fit.slow_lines import _zoomed  # pyright: ignore[reportPrivateUsage]


@pytest.mark.parametrize(("n", "count"), [(64, 65), (1000, 65), (21_600, 65), (21_599, 3)])
def test_it_is_the_transform_at_fractions_of_a_cycle(n: int, count: int) -> None:
    """The phases of a chirp of n samples reach π·n·step, a few thousand: their rounding is below 1e-10 of the sum."""
    y = np.random.Generator(np.random.PCG64(n)).normal(size=n)
    begin, step = 6.0, 2.0 / (count - 1)
    span = np.array([begin, begin + step * (count - 1)]) / n * 2.0
    wanted = np.abs(zoom_fft(y, span, count, fs=2.0, endpoint=True))
    assert np.allclose(np.abs(_zoomed(y, begin, step, count)), wanted, rtol=0.0, atol=1e-10 * float(np.sum(np.abs(y))))
