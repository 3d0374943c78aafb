"""Positions set by hand of which two are exchanged, a turn in the other sense, channels reversed: failed and named."""

import re

import numpy as np
import pytest

from procedures.core.limits import Verdict
from tests.cases import calibrations as made


@pytest.mark.parametrize("seed", range(10))
def test_exchanged_positions_are_named(seed: int) -> None:
    trial = made.exchanged(np.random.default_rng([25, seed]))
    said = made.outcome(trial)
    assert not said.passed
    right = list(made.TURNS)
    wrong = [tuple(p) for p in trial.parameters["positions"]]
    i, j = (k + 1 for k in range(len(right)) if right[k] != wrong[k])
    # Others that are seen alike by gravity, such as its two upright ones, may be named beside them.
    assert re.search(rf"positions {i} and {j} seem exchanged", said.said), said


def test_the_right_list_passes_and_finds_bias_and_scale() -> None:
    trial = made.clean_field(np.random.default_rng(26))
    said = made.outcome(trial)
    assert said.verdict == Verdict.PASS.value
    assert "seem" not in said.said


@pytest.mark.parametrize("seed", range(5))
def test_a_turn_in_the_other_sense_is_refused_by_the_sign_of_the_scale_factor(seed: int) -> None:
    said = made.outcome(made.other_sense(np.random.default_rng([27, seed])))
    assert said.verdict == "refused"
    assert "the scale factor of accelerometer x comes out as -" in said.said
    assert "channel x seems reversed or α seems turned in the other sense" in said.said


@pytest.mark.parametrize("seed", range(5))
def test_a_reversed_channel_is_refused_by_name(seed: int) -> None:
    rng = np.random.default_rng([28, seed])
    axis = "xyz"[int(np.random.default_rng([28, seed]).integers(3))]
    said = made.outcome(made.reversed_channel(rng))
    assert said.verdict == "refused"
    assert f"the scale factor of accelerometer {axis} comes out as -" in said.said
    assert f"channel {axis} seems reversed" in said.said


@pytest.mark.parametrize("name", ["field, gyros reversed", "field, gyros exchanged", "field, gyros clipped"])
def test_gyros_that_do_not_feel_the_earth_as_declared_do_not_pass(name: str) -> None:
    rng = np.random.default_rng([29, *name.encode()])
    for _ in range(4):
        said = made.outcome(made.BROKEN_FIELD[name](rng))
        assert not said.passed
        assert "gyro" in said.said
        if "clipped" not in name:
            assert "seem" in said.said, said


@pytest.mark.parametrize("name", made.CLEAN_FIELD)
def test_what_is_clean_passes(name: str) -> None:
    rng = np.random.default_rng([30, *name.encode()])
    said = [made.outcome(made.CLEAN_FIELD[name](rng)) for _ in range(4)]
    assert all(s.passed for s in said), said
