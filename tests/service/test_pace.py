"""Pace of a unit's samples over wires: arrival that scatters is no loss, a world that falls behind is told."""

from dataclasses import replace

import numpy as np
import pytest

from bench_service.bench.pace import PaceLog
from procedures.analysis.measured_pace import fell_behind
from procedures.core.measured import Measured, MeasuredPace
from procedures.core.recording import RecordingInfo

BLOCK_S = 0.25


def _arrived(seed: int, blocks: int, slower: float = 0.0, stood_s: float = 0.0) -> MeasuredPace | None:
    """Pace of blocks that come late by 20 ms on average, of a world that is slower or stood at the middle."""
    rng, log = np.random.default_rng(seed), PaceLog(7.0)
    for k in range(1, blocks + 1):
        made_s = 7.0 + k * BLOCK_S * (1.0 + slower) + (stood_s if k > blocks // 2 else 0.0)
        log.block(made_s + rng.exponential(0.02), k * BLOCK_S)
    return log.measured()


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize(("slower", "stood_s", "behind_s"), [(0.0, 0.0, 0.0), (0.03, 0.0, 0.6), (0.0, 0.5, 0.5)])
def test_what_is_lost_is_measured_and_what_comes_late_is_not(
    seed: int, slower: float, stood_s: float, behind_s: float
) -> None:
    """The least of 16 exponential delays of 20 ms is above 20 ms once in e^16 trials: both ends are known to that."""
    found = _arrived(seed, 80, slower, stood_s)
    assert found is not None
    # A drift of 3 % goes on within the 16 blocks of each end: from 0.48 to 0.6 s.
    assert behind_s - 0.02 - 32 * BLOCK_S * slower <= found.behind_s <= behind_s + 0.02
    assert found.scatter_s < 0.06 + 16 * BLOCK_S * slower


def test_a_recording_of_few_blocks_has_no_pace() -> None:
    assert _arrived(1, 7) is None
    assert _arrived(1, 8) is not None


def _recorded(pace: MeasuredPace | None) -> RecordingInfo:
    return RecordingInfo("r", "u", (), 400.0, 8000, 0.0, measured=Measured(pace=pace))


def test_the_result_says_at_how_many_recordings_and_by_how_much() -> None:
    kept = _recorded(MeasuredPace(0.05, 0.01))  # 0.25 % of 20 s
    late = _recorded(MeasuredPace(0.62, 0.01))
    unsure = _recorded(MeasuredPace(0.62, 0.3))
    assert fell_behind([kept, unsure, _recorded(None), replace(kept, measured=None)]) == ()
    (sentence,) = fell_behind([kept, late, unsure])
    assert (
        "in 1 of 3 recordings the unit's samples fell behind the bench's clock, at worst by 0.62 s within 20 s"
        in sentence
    )
    (sentence,) = fell_behind([_recorded(MeasuredPace(-2.0, 0.01))])
    assert "were ahead of" in sentence
