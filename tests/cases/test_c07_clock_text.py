"""Stamps that are the text of a clock, that lost digits, or that are in another unit than their column says."""

from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pytest

from tests.cases.tables import chance, read, refusal, table, timed, triad, warnings

FORCE = triad("accelerometer", ["ax", "ay", "az"], "g")


def _accelerometers(stamps: list[str], seed: int = 7) -> str:
    values = chance(seed).normal(0.0, 0.01, (len(stamps), 3)) + np.array([0.0, 0.0, 1.0])
    rows = [(stamp, *(f"{v:.4f}" for v in row)) for stamp, row in zip(stamps, values, strict=True)]
    return table(["time", "ax", "ay", "az"], rows)


def _moments(start: datetime, step_us: int, count: int = 600) -> list[datetime]:
    return [start + timedelta(microseconds=step_us * i) for i in range(count)]


@pytest.mark.parametrize(
    "written",
    [
        lambda t: f"{t:%H:%M:%S}.{t.microsecond // 1000:03d}",
        lambda t: f"{t:%M:%S}.{t.microsecond // 1000:03d}",
        lambda t: str(t),
        lambda t: t.isoformat() + "Z",
        lambda t: f"{t:%Y/%m/%d %H:%M:%S.%f}",
        lambda t: f"{t:%Y-%m-%dT%H:%M:%S.%f}+0200",
    ],
)
def test_the_text_of_a_clock_is_read_where_it_is_asked_for(written: Any) -> None:
    moments = _moments(datetime(2023, 6, 20, 0, 16, 30, 818_000), 100_000)
    recording = read(
        _accelerometers([written(t) for t in moments]), time_column="time", time_unit="clock", channels=FORCE
    )
    assert recording.rate_hz == pytest.approx(10.0, rel=1e-9)
    assert recording.source["warnings"] == []


def test_text_of_a_clock_is_named_with_the_way_out() -> None:
    text = _accelerometers(["00:16:30.818", "00:16:30.918"])
    words = refusal(text, time_column="time", channels=FORCE)
    assert "'00:16:30.818' where a finite number was expected: text of a clock" in words
    assert 'time_unit = "clock"' in words
    assert "leave time_column out and give rate_hz" in words


def test_milliseconds_without_leading_zeros_are_named_and_read_on_request() -> None:
    moments = _moments(datetime(2023, 6, 20, 0, 16, 30, 818_000), 100_000)
    text = _accelerometers([f"{t:%H:%M:%S}.{t.microsecond // 1000}" for t in moments])
    asked = {"time_column": "time", "time_unit": "clock", "channels": FORCE}
    words = refusal(text, **asked)
    assert "the time does not grow: 991.18 s in row 3, 991.118 s in row 4" in words
    assert 'clock_fraction = "ms"' in words
    assert read(text, **asked, clock_fraction="ms").rate_hz == pytest.approx(10.0, rel=1e-12)


def test_a_whole_second_may_lack_its_fraction() -> None:
    moments = _moments(datetime(2016, 5, 23, 21, 46, 20), 100_000)
    stamps = [str(t) for t in moments]
    assert "." not in stamps[0]
    recording = read(_accelerometers(stamps), time_column="time", time_unit="clock", channels=FORCE)
    assert recording.rate_hz == pytest.approx(10.0, rel=1e-9)


def test_a_clock_that_passes_midnight_is_named_and_carried_on() -> None:
    moments = _moments(datetime(2023, 6, 20, 23, 59, 50), 100_000)
    text = _accelerometers([f"{t:%H:%M:%S.%f}" for t in moments])
    asked = {"time_column": "time", "time_unit": "clock", "channels": FORCE}
    assert "the clock wraps at a day: 86399.9 s in row 100, 0 s in row 101" in refusal(text, **asked)
    assert read(text, **asked, unwrap_clock=True).rate_hz == pytest.approx(10.0, rel=1e-9)


def test_stamps_that_lost_all_their_digits_are_no_clock() -> None:
    text = _accelerometers([f"{1732340000.25 + 0.005 * i:.5e}" for i in range(600)])
    words = refusal(text, time_column="time", channels=FORCE)
    assert "all 600 rows have the time 1732340000.0: digits were lost" in words
    assert "leave time_column out and give rate_hz" in words


def test_digits_that_are_lost_on_the_way_are_named() -> None:
    # %g prints six digits: from 1000 s on 5 ms are rounded to 10 ms.
    text, asked = timed([f"{0.005 * i:g}" for i in range(190_000, 260_000)])
    recording = read(text, **asked)
    assert "lost digits in printing: its resolution goes from 0.001 s to 0.01 s" in warnings(recording)
    assert recording.rate_hz == pytest.approx(200.0, rel=1e-4)


@pytest.mark.parametrize(
    ("name", "step", "unit", "words"),
    [
        ("time_ms", 0.005, "ms", ["200000 Hz is an unlikely rate", "200 Hz if the column is in s"]),
        ("t", 10, "s", ["0.1 Hz is an unlikely rate", "100 Hz if the column is in ms"]),
        ("time_ms", 5, "s", ["the time column's name 'time_ms' says ms, the description s", "would be 200 Hz"]),
        ("stamp [ns]", 5000, "us", ["the time column's name 'stamp [ns]' says ns, the description us"]),
    ],
)
def test_a_factor_of_a_thousand_is_suspected(name: str, step: float, unit: str, words: list[str]) -> None:
    rows = [(np.round(i * step, 6), i % 7) for i in range(2000)]
    gyro = {"name": "gyro_x", "column": "gx", "quantity": "angular_rate", "unit": "rad/s"}
    recording = read(table([name, "gx"], rows), time_column=name, time_unit=unit, channels=[gyro])
    for expected in words:
        assert expected in warnings(recording)


def test_a_factor_of_a_thousand_against_the_declared_rate_is_refused_in_words() -> None:
    text, asked = timed([0.005 * i for i in range(2000)], time_unit="ms", rate_hz=200.0)
    assert "a factor of 1000: is ms the unit of the time column?" in refusal(text, **asked)


def test_a_rate_that_its_clock_shows_to_be_another_is_said() -> None:
    text, asked = timed(np.arange(20_000) / 100.4, rate_hz=100.0)
    recording = read(text, **asked)
    assert recording.rate_hz == 100.0
    assert "the time column says 100.4 Hz, +0.4 % off the declared 100 Hz" in warnings(recording)
    # Stamps in whole milliseconds over half a second: 0.2 % is within what such a clock can say.
    short, asked = timed(np.round(np.arange(50) * 1000.0 / 100.2), rate_hz=100.0, time_unit="ms")
    assert read(short, **asked).source["warnings"] == []
