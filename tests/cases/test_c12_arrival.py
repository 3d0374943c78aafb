"""Rows that are stamped when they arrive, in pairs, bursts or batches: the mean rate is right and no loss is named."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.cases.tables import chance, read, refusal, timed, warnings

Stamps = np.ndarray[Any, np.dtype[np.float64]]


def _pairs(rate_hz: float, rows: int) -> Stamps:
    """A serial line that is read every two periods; the second of a pair 0.4 ms after the first."""
    period = 1.0 / rate_hz
    tick = np.ceil(np.arange(rows) * period / (2 * period) - 1e-9) * 2 * period
    tick[1:][np.diff(tick) < 1e-9] += 0.0004
    return tick + 1640500000.0


def _bursts(rate_hz: float, rows: int, size: int) -> Stamps:
    """So many rows half a period apart, then a pause."""
    k = np.arange(rows)
    return (k // size * size + 0.5 * (k % size)) / rate_hz


def _batches(rate_hz: float, rows: int, size: int) -> Stamps:
    """So many rows at once, a nanosecond apart."""
    k = np.arange(rows)
    return (k // size + 1) * size / rate_hz + k % size * 1e-9


CASES: dict[str, tuple[Callable[[int], Stamps], float, int]] = {
    "pairs": (lambda n: _pairs(200.0, n), 200.0, 2),
    "bursts of 5": (lambda n: _bursts(500.0, n, 5), 500.0, 5),
    "bursts of 3": (lambda n: _bursts(250.0, n, 3), 250.0, 3),
    "batches of 32": (lambda n: _batches(819.2, n, 32), 819.2, 32),
    "batches of 10": (lambda n: _batches(1000.0, n, 10), 1000.0, 10),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("rows", [1000, 20_000])
@pytest.mark.parametrize("declared", [False, True])
def test_batches_are_named_and_no_loss(case: str, rows: int, declared: bool) -> None:
    make, rate_hz, batch = CASES[case]
    text, asked = timed([f"{t:.9f}" for t in make(rows)])
    recording = read(text, **asked, **({"rate_hz": rate_hz} if declared else {}))
    # From batch to batch the stamps are exact up to the resolution of a double near 1.6e9 s, 2.4e-7 s.
    assert recording.source["rate_of_time_column_hz"] == pytest.approx(rate_hz, rel=2e-7 * rate_hz)
    clock = recording.source["clock"]
    assert (clock["arrival"], clock["rows_in_a_batch"], clock["lost_samples"]) == ("batches", batch, 0)
    assert "arrival in batches" in warnings(recording)
    assert "no sample is lost" in warnings(recording)


def test_a_batch_that_is_lost_is_named_all_the_same() -> None:
    stamps = np.delete(_batches(819.2, 6400, 32), np.arange(3200, 3232))
    text, asked = timed([f"{t:.9f}" for t in stamps])
    assert "32 samples are missing in 1 place: 32 between rows 3200 and 3201" in refusal(text, **asked)


def test_a_third_of_the_rows_missing_is_no_arrival_in_pairs() -> None:
    # As flight logs are: rows 1, 2, 4, 5, 7 … of 250 Hz, their stamps a little off.
    stamps = 4000 * np.arange(9000) + chance(4).integers(-30, 31, 9000) + 17_000_000
    text, asked = timed(np.delete(stamps, np.arange(2, 9000, 3)), time_unit="us")
    words = refusal(text, **asked)
    assert "at 250 Hz 2999 samples are missing in 2999 places: 1 between rows 2 and 3" in words
    recording = read(text, **asked, gaps="mark")
    assert recording.rate_hz == pytest.approx(250.0, rel=1e-5)
    assert recording.count == 8999  # the last row is one of those that are missing
    found = np.concatenate(list(recording.blocks()))
    assert np.isnan(found[2::3]).all()
    assert np.isfinite(np.delete(found, np.arange(2, 8999, 3), axis=0)).all()


@pytest.mark.parametrize("first_s", [0.016, 0.161])
def test_a_first_step_that_is_long_leaves_a_range_without_it(first_s: float) -> None:
    stamps = 0.004 * np.arange(5000)
    stamps[1:] += first_s - 0.004
    text, asked = timed([f"{t:.6f}" for t in stamps])
    words = refusal(text, **asked)
    assert f"{round(first_s / 0.004) - 1} samples are missing in 1 place" in words
    assert 'rows = {"first": 2}' in words
    assert read(text, **asked, rows={"first": 2}).rate_hz == pytest.approx(250.0, rel=1e-9)


@pytest.mark.parametrize(("rows", "said"), [(40, False), (400, True)])
def test_rows_that_were_held_up_are_no_loss(rows: int, said: bool) -> None:
    stamps = 0.005 * np.arange(8000)
    stamps[3000 : 3000 + rows] = stamps[3000 + rows] - 1e-5 * np.arange(rows)[::-1]
    text, asked = timed([f"{t:.6f}" for t in stamps])
    recording = read(text, **asked)
    assert recording.rate_hz == pytest.approx(200.0, rel=1e-9)
    assert recording.source["clock"]["lost_samples"] == 0
    assert ("stamps are late or early in 1 place" in warnings(recording)) == said
