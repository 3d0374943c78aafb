"""Time columns of any rate, resolution and losses: what was left out is found, and nothing else is."""

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.cases.tables import chance, read, refusal, timed

QUICK = settings(max_examples=40, deadline=None, derandomize=True)


def _clock(stamps: Any, **asked: Any) -> Any:
    text, description = timed(stamps, **asked)
    return read(text, **description).source


@QUICK
@given(rate_hz=st.floats(2.0, 3000.0), rows=st.integers(200, 3000), unit=st.sampled_from([1e-3, 1e-4, 1e-6]))
def test_a_uniform_clock_of_any_resolution_has_no_gap(rate_hz: float, rows: int, unit: float) -> None:
    ticks = np.rint(np.arange(rows) / rate_hz / unit).astype(int)
    if ticks[-1] < 100:  # fewer ticks than that are no clock
        return
    name = {1e-3: "ms", 1e-6: "us"}.get(unit)
    stamps = ticks if name else [f"{t * unit:.4f}" for t in ticks]
    source = _clock(stamps, time_unit=name or "s")
    assert source["clock"]["lost_samples"] == 0
    # Each end is off by half a tick at most, and a coarse clock's runs are counted to a row at each end.
    assert abs(source["rate_of_time_column_hz"] / rate_hz - 1.0) <= 2.5 * unit * rate_hz / (rows - 1) + 2.0 / (rows - 1)


@QUICK
@given(
    rate_hz=st.floats(5.0, 2000.0),
    jitter=st.floats(0.0, 0.15),
    places=st.lists(st.integers(100, 1900), min_size=1, max_size=12, unique=True),
    lengths=st.lists(st.integers(1, 40), min_size=12, max_size=12),
    seed=st.integers(0, 1000),
)
def test_rows_that_are_lost_are_counted_and_placed(
    rate_hz: float, jitter: float, places: list[int], lengths: list[int], seed: int
) -> None:
    lost = np.unique(np.concatenate([np.arange(p, p + n) for p, n in zip(sorted(places), lengths, strict=False)]))
    lost = lost[lost < 1990]
    times = (np.arange(2000) + jitter * chance(seed).uniform(-1.0, 1.0, 2000)) / rate_hz
    kept = np.delete(np.arange(2000), lost)
    source = _clock([f"{t:.9f}" for t in times[kept]], gaps="mark")
    found = {place["after_row"]: place["lost"] for place in source["clock"]["places"]}
    runs = np.flatnonzero(np.diff(kept) > 1)
    assert found == {int(i) + 1: int(kept[i + 1] - kept[i] - 1) for i in runs}


@QUICK
@given(
    rate_hz=st.floats(20.0, 2000.0),
    batch=st.integers(2, 40),
    spread=st.sampled_from([0.0, 1e-9, 0.2, 0.5]),
    phase=st.integers(0, 39),
)
def test_rows_that_come_in_batches_are_none_lost(rate_hz: float, batch: int, spread: float, phase: int) -> None:
    k = np.arange(4000) + phase % batch
    stamps = (k // batch * batch + spread * (k % batch)) / rate_hz
    source = _clock([f"{t:.9f}" for t in stamps])
    assert source["clock"]["lost_samples"] == 0
    # From batch to batch, or through stamps that are off by a batch at most at each end.
    assert abs(source["rate_of_time_column_hz"] / rate_hz - 1.0) <= 2.0 * batch / 4000


@pytest.mark.parametrize("rate_hz", [100.3, 130.7, 400.7, 2000.5, 7999.0])
def test_stamps_in_whole_seconds_give_the_rate(rate_hz: float) -> None:
    rows = int(12 * rate_hz)
    source = _clock(np.floor(np.arange(rows) / rate_hz).astype(int))
    assert source["clock"]["lost_samples"] == 0
    # From the second batch to the last: ten batches, each end off by a row at most.
    assert abs(source["rate_of_time_column_hz"] - rate_hz) <= 2.0 / 10.0


@pytest.mark.parametrize(
    ("begin", "end", "says"),
    [
        (1500, 3000, 'rows 1501 to 3000, 1500 in a row, have one time.*rows = {"first": 1, "last": 1501} ends there'),
        (0, 1000, 'rows 1 to 1000, 1000 in a row, have one time.*rows = {"first": 1000} begins after it'),
        (1000, 1300, "rows 1001 to 1300, 300 in a row"),
    ],
)
def test_a_clock_that_stands_still_is_named_with_the_rows_that_move(begin: int, end: int, says: str) -> None:
    rows = np.arange(3000)
    stamps = np.maximum(rows, end - 1) if begin == 0 else np.where((rows >= begin) & (rows < end), begin, rows)
    text, description = timed(stamps / 100)
    assert re.search(says, refusal(text, **description))


def test_rows_that_waited_for_the_link_are_no_clock_that_stands_still() -> None:
    stamps = np.arange(3000) / 100
    stamps[1000:1300] = 13.0
    assert _clock(stamps)["clock"]["lost_samples"] == 0


def test_two_stamps_are_no_clock() -> None:
    text, description = timed(np.where(np.arange(3000) < 2000, 0.0, 128.0))
    assert "only 2 different times, at least 5 are needed" in refusal(text, **description)
