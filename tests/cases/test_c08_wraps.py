"""A counter of time that begins again is named with its period and its row, and carried on where that is asked for."""

import numpy as np
import pytest

from tests.cases.tables import read, refusal, timed, warnings


@pytest.mark.parametrize(
    ("bits", "unit", "rate_hz", "signed", "name"),
    [
        (32, "us", 10.0, False, "2^32 µs"),
        (32, "us", 10.0, True, "2^32 µs"),
        (32, "us", 400.0, True, "2^32 µs"),
        (16, "ms", 100.0, False, "2^16 ms"),
        (16, "us", 2000.0, True, "2^16 µs"),
        (24, "us", 250.0, False, "2^24 µs"),
        (32, "ns", 1000.0, False, "2^32 ns"),
    ],
)
def test_a_wrap_is_named_and_carried_on(bits: int, unit: str, rate_hz: float, signed: bool, name: str) -> None:
    scale = {"ms": 1e3, "us": 1e6, "ns": 1e9}[unit]
    low = -(2 ** (bits - 1)) if signed else 0
    top = 2**bits + low
    step = round(scale / rate_hz)
    begin = top - 40 * step - 7 * step // 10
    stamps = [(begin + i * step - low) % 2**bits + low for i in range(90)]
    text, asked = timed(stamps, time_unit=unit)
    words = refusal(text, **asked)
    assert f"the clock wraps at {name}: {stamps[40]} {unit} in row 41, {stamps[41]} {unit} in row 42" in words
    assert "unwrap_clock = true" in words
    recording = read(text, **asked, unwrap_clock=True)
    # Between the first and the last stamp lie 89 steps of whole ticks.
    assert recording.rate_hz == pytest.approx(scale / step, rel=1e-9)
    assert recording.count == 90
    assert f"the clock wrapped at {name} 1 time" in warnings(recording)
    assert recording.source["clock"]["lost_samples"] == 0


def test_a_wrap_in_seconds_is_one_too() -> None:
    stamps = [f"{((4294.9 + 0.01 * i) % 4294.967296):.6f}" for i in range(500)]
    text, asked = timed(stamps)
    assert "wraps at 2^32 µs" in refusal(text, **asked)
    assert read(text, **asked, unwrap_clock=True).rate_hz == pytest.approx(100.0, rel=1e-6)


def test_several_wraps_and_a_loss_across_one() -> None:
    step = 2500
    kept = np.delete(np.arange(100_000), np.arange(26_213, 26_216))  # three samples at the first wrap, 26214.4 steps in
    text, asked = timed((kept * step) % 2**16, time_unit="us")  # the counter wraps every 26 samples
    words = refusal(text, **asked, unwrap_clock=True)
    assert "3 samples are missing in 1 place: 3 between rows 26213 and 26214" in words


def test_a_fall_that_is_no_wrap_is_not_called_one() -> None:
    stamps = [*np.arange(500) * 2500, *(np.arange(500) * 2500 + 17)]
    text, asked = timed(stamps, time_unit="us")
    words = refusal(text, **asked, unwrap_clock=True)
    assert "the time does not grow: 1247500 us in row 500, 17 us in row 501" in words
    assert "nothing is sorted" in words
    assert read(text, **asked, rows={"first": 501}).rate_hz == pytest.approx(400.0)
