"""Polarity check on the simulated bench: a good unit, and channels exchanged, reversed, dead or askew."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from procedures.catalog import discover
from procedures.core.errors import BadParameter
from procedures.core.limits import Verdict
from procedures.core.recording import MemoryRecording, Quantity
from procedures.procedure import Context
from tests.kit.procedures import acquired, require_result, simulated_context

POLARITY = discover()["polarity_check"]
PARAMS = POLARITY.resolve(POLARITY.params(), simulated_context())


@pytest.fixture(scope="module")
def context() -> Context:
    return simulated_context()


@pytest.fixture(scope="module")
def taken() -> list[MemoryRecording]:
    return acquired(POLARITY, POLARITY.schedule(PARAMS), seed=5)


def wired(taken: Sequence[MemoryRecording], rows: dict[str, tuple[tuple[str, int], ...]]) -> list[MemoryRecording]:
    """The recordings with some channels made of others, each a sum of (channel, sign): counts keep their meaning."""
    made: list[MemoryRecording] = []
    for r in taken:
        raw = np.array(r.raw, dtype=np.float64)
        for name, parts in rows.items():
            raw[:, r.info.column(name)] = sum(sign * r.raw[:, r.info.column(other)] for other, sign in parts)
        made.append(MemoryRecording(r.info, raw))
    return made


def analysed(recordings: Sequence[MemoryRecording], context: Context) -> Any:
    result = POLARITY.analyse(recordings, PARAMS, context)
    require_result(POLARITY, result)
    return result


def test_a_good_unit_passes_in_two_minutes(taken: list[MemoryRecording], context: Context):
    result = analysed(taken, context)
    assert result.verdict is Verdict.PASS
    assert result.sentences == result.warnings == ()
    assert [a.axes for a in result.triads] == [("+x", "+y", "+z")] * 2
    quantities = POLARITY.quantities
    assert quantities is not None
    assert tuple(c.name for c in result.checks) == quantities(PARAMS, context)
    planned = {one.check: one.limit for one in POLARITY.planned_checks(PARAMS, context)}
    assert planned == {c.name: c.limit for c in result.checks}
    assert POLARITY.predict(PARAMS, context).duration_s < 120.0
    # The default unit's K of the thesis's tables 5.1, 5.2, to what pulses, level and rest leave of one turn.
    assert np.array(result.triads[0].matrix).diagonal() == pytest.approx([1.0048, 1.0017, 1.0009], abs=0.002)
    assert np.array(result.triads[1].matrix).diagonal() == pytest.approx([0.8148, 0.8588, 0.8531], abs=0.02)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ({"gyro_x": (("gyro_y", 1),), "gyro_y": (("gyro_x", 1),)}, "gyro_x and gyro_y are exchanged"),
        ({"gyro_x": (("gyro_z", -1),), "gyro_z": (("gyro_x", 1),)}, "gyro_x and gyro_z are exchanged (−z and +x)"),
        ({"accelerometer_z": (("accelerometer_z", -1),)}, "accelerometer_z is reversed"),
        ({"gyro_y": ()}, "gyro_y answers to nothing"),
        ({"gyro_y": (("gyro_x", 1),)}, "gyro_y answers to +x"),
        ({"accelerometer_x": (("accelerometer_x", 1), ("accelerometer_y", 1))}, "answers to no single axis"),
    ],
)
def test_a_wrong_channel_fails_and_is_named(rows: Any, said: str, taken: list[MemoryRecording], context: Context):
    result = analysed(wired(taken, rows), context)
    assert result.verdict is Verdict.FAIL
    assert said in result.sentences[0]
    assert len(result.sentences) == 1
    assert said in POLARITY.report(result).summary
    assert any(said in c.note for c in result.checks if not c.passed)


def test_a_turned_mounting_is_told_from_axes_that_no_mounting_gives(taken: list[MemoryRecording], context: Context):
    turned = {f"{t}_x": ((f"{t}_y", 1),) for t in ("gyro", "accelerometer")}
    turned |= {f"{t}_y": ((f"{t}_x", -1),) for t in ("gyro", "accelerometer")}
    assert "mounted turned" in analysed(wired(taken, turned), context).sentences[-1]
    mirrored = {f"{t}_x": ((f"{t}_x", -1),) for t in ("gyro", "accelerometer")}
    assert "left-handed" in analysed(wired(taken, mirrored), context).sentences[-1]


def test_counts_are_judged_by_their_largest_answer(taken: list[MemoryRecording], context: Context):
    unknown = [
        MemoryRecording(
            replace(
                r.info,
                channels=tuple(
                    c if c.quantity is Quantity.TEMPERATURE else replace(c, unit="count", scale=1.0)
                    for c in r.info.channels
                ),
            ),
            r.raw,
        )
        for r in taken
    ]
    result = analysed(unknown, context)
    assert result.verdict is Verdict.PASS
    assert all(a.relative for a in result.triads)


def test_a_turn_that_the_table_cannot_make_is_refused(context: Context):
    with pytest.raises(BadParameter, match="ramp_s"):
        POLARITY.schedule(POLARITY.params())
    with pytest.raises(BadParameter, match="rate is not reached"):
        POLARITY.schedule(POLARITY.params(rate_deg_s=300.0, ramp_s=10.0))
    with pytest.raises(BadParameter, match="rate_deg_s"):
        POLARITY.predict(POLARITY.params(rate_deg_s=300.0, ramp_s=0.2), context)
