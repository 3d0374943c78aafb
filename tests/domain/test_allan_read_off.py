"""The graphical read-off: each process alone is read on its line, and the others are absent."""

import numpy as np
import pytest

from procedures.analysis.allan.deviation import deviation
from procedures.analysis.allan.read_off import read_off
from procedures.analysis.allan.statistic import MODIFIED_ALLAN
from procedures.core.errors import BadParameter

RATE_HZ = 10.0
COUNT = 200_000
PROCESSES = ("quantization", "random_walk", "bias_instability", "rate_random_walk", "rate_ramp")


def alone(process: str, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Rates of one process, (COUNT,), and its coefficient in SI."""
    white, dt = rng.normal(size=COUNT + 1), 1.0 / RATE_HZ
    match process:
        case "quantization":  # readings with a standard deviation of 0.3
            return np.diff(0.3 * white) / dt, 0.3
        case "random_walk":
            return 0.02 * white[1:] / np.sqrt(dt), 0.02
        case "rate_random_walk":
            return 0.05 * np.cumsum(white[1:]) * np.sqrt(dt), 0.05
        case "rate_ramp":
            return 1e-3 * np.arange(COUNT) * dt + 1e-6 * white[1:], 1e-3
        case _:  # density B²/(π f), one-sided: the spectral amplitude of a realisation of COUNT samples
            f = np.fft.rfftfreq(COUNT, dt)
            shape = np.zeros(len(f))
            shape[1:] = np.sqrt(0.4**2 / (np.pi * f[1:]) / 2 / dt)
            return np.fft.irfft(np.fft.rfft(white[1:]) * shape, COUNT), 0.4


@pytest.mark.parametrize("process", PROCESSES)
def test_each_process_alone(process: str) -> None:
    """Within 3 %: a stretch's best point has thousands of degrees of freedom; the walk's best one 10⁵ and more."""
    y, true = alone(process, np.random.default_rng(8))
    lines = read_off(deviation(y, RATE_HZ))
    found = getattr(lines, process)
    assert found is not None
    assert found.coefficient == pytest.approx(true, rel=0.03)
    assert found.to_s / found.from_s > 10.0
    assert [name for name in PROCESSES if getattr(lines, name) is not None] == [process]


def test_two_processes_and_no_third_between_them() -> None:
    """From −½ to +½ the slope passes zero within 0.2 decades: no bias instability."""
    rng = np.random.default_rng(9)
    white, true_n = alone("random_walk", rng)
    walk, _ = alone("rate_random_walk", rng)
    lines = read_off(deviation(white + 0.02 * walk, RATE_HZ))
    assert lines.random_walk is not None
    assert lines.random_walk.coefficient == pytest.approx(true_n, rel=0.05)
    assert lines.bias_instability is None
    assert lines.quantization is None


def test_another_statistic_is_refused() -> None:
    y, _ = alone("random_walk", np.random.default_rng(1))
    with pytest.raises(BadParameter, match="modified_allan"):
        read_off(deviation(y[:1000], RATE_HZ, MODIFIED_ALLAN))
