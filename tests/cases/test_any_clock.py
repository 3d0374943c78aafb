"""Time columns of any rate, resolution and losses: what was left out is found, and nothing else is."""

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.cases.tables import chance, read, timed

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
