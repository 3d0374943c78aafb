"""The interval of a slope against sequences whose slope is known, with values that resemble their neighbours."""

import numpy as np
import pytest

from tests.soak.level import LEVEL_MB, Samples, growing, judged
from tests.soak.slope import Slope, slope

MINUTES = np.arange(45.0)
TRIALS = 400


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_the_interval_holds_the_true_slope_about_as_often_as_it_says(correlation: float) -> None:
    """At least 80 % of 400 intervals of 95 % hold the truth.

    Newey and West's interval is known to be too narrow for short records whose values resemble their neighbours, so
    less than 95 % is expected. Least squares without it would hold in about 74 % at a correlation of 0.5: its variance
    lacks the factor (1 + 0.5)/(1 - 0.5) = 3, and P(|t| < 2.02/√3) = 0.75. The standard error of that share of 400 is
    0.022, so 0.80 tells the two apart.
    """
    rng = np.random.Generator(np.random.PCG64(5))
    held = 0
    for _ in range(TRIALS):
        noise = rng.normal(size=(45 + 50))
        for index in range(1, len(noise)):
            noise[index] += correlation * noise[index - 1]
        found = slope(MINUTES + 0.5, 500.0 + 0.3 * MINUTES + noise[50:])
        held += found.low <= 0.3 <= found.high
    assert held / TRIALS >= 0.80


def test_samples_of_a_minute_count_as_one() -> None:
    times = np.arange(0.0, 45.0, 0.05)
    exact = slope(times, 7.0 + 2.0 * times)
    assert exact.per_min == pytest.approx(2.0)
    assert exact.high - exact.low < 1e-9


def test_a_short_soak_gives_no_slope() -> None:
    with pytest.raises(ValueError, match="8 are needed"):
        slope(np.arange(0.0, 5.0, 0.1), np.zeros(50))


def test_level_is_an_interval_below_the_bound_and_neither_growth_nor_ignorance() -> None:
    assert judged("memory", Slope(0.1 * LEVEL_MB, -LEVEL_MB, 0.9 * LEVEL_MB)) == []
    assert judged("memory", Slope(-LEVEL_MB, -2 * LEVEL_MB, 0.0)) == []
    assert "grows" in judged("memory", Slope(2 * LEVEL_MB, 1.5 * LEVEL_MB, 2.5 * LEVEL_MB))[0]
    assert "does not tell" in judged("memory", Slope(0.5 * LEVEL_MB, -LEVEL_MB, 2 * LEVEL_MB))[0]


def a_service(minutes: np.ndarray, memory_mb: np.ndarray) -> Samples:
    """Samples of a service whose descriptors and threads stay as they are."""
    count = len(minutes)
    return Samples(minutes.tolist(), memory_mb.tolist(), memory_mb.tolist(), [50] * count, [30] * count)


def test_memory_without_a_slope_is_not_determined_and_no_pass(capsys: pytest.CaptureFixture[str]) -> None:
    short = np.arange(0.0, 6.0, 0.1)
    (unknown,) = growing(a_service(short, 0.0 * short), 6.0)
    assert unknown.startswith("memory: its growth is not determined: 5 minutes are too few for a slope: 8 are needed")
    assert growing(a_service(MINUTES, 200.0 + 0.0 * MINUTES), 45.0) == []
    (grown,) = growing(a_service(MINUTES, 200.0 + MINUTES), 45.0)
    assert grown.startswith("memory grows by +1.000 a minute")
    assert [text.split(":")[1] for text in growing(Samples(), 45.0)] == [
        " not determined",
        " its growth is not determined",
    ]
    assert "MB by quarter" in capsys.readouterr().out
