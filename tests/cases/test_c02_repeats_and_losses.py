"""Rows written twice with one stamp, others lost: counted apart, placed, and neither falsifies the rate."""

from typing import Any

import numpy as np
import pytest

from tests.cases.tables import chance, read, refusal, samples, table, triad, warnings

RATE_HZ = 398.0


def _recording(lost: list[int], twice: list[int], rows: int = 3000) -> tuple[str, dict[str, Any], np.ndarray[Any, Any]]:
    """A table whose header holds units, its description, and the samples that are in it once."""
    values = chance(2).normal(0.0, 1.0, (rows, 3)).round(5)
    written: list[list[str]] = []
    for i in range(rows):
        if i not in lost:
            row = [f"{i / RATE_HZ:.6f}", *(f"{v:.5f}" for v in values[i])]
            written += [row, row] if i in twice else [row]
    names = ["Time (s)", " Gyroscope X (deg/s)", " Gyroscope Y (deg/s)", " Gyroscope Z (deg/s)"]
    channels = triad("gyro", [name.strip() for name in names[1:]], "deg/s")
    description = {"time_column": "Time (s)", "channels": channels}
    values[lost] = np.nan
    return table(names, written), description, values


LOST = [*range(700, 720), 1500, 2200, 2201]
TWICE = [1, 100, 300, 2500]


def test_one_refusal_counts_both_and_places_them() -> None:
    text, description, _ = _recording(LOST, TWICE)
    words = refusal(text, **description)
    assert "4 rows repeat the row before, time and values: row 3 (0.002513 s from the first), row 103" in words
    # Two rows were written twice before sample 700, which so has row 703; three before 1500, 20 lost.
    assert "23 samples are missing in 3 places: 20 between rows 703 and 704 (1.75628 s from the first)" in words
    assert "1 between rows 1483 and 1484" in words
    assert "at 398 Hz" in words
    assert 'repeats = "drop"' in words
    assert 'gaps = "mark"' in words


def test_what_was_asked_for_is_done_and_said() -> None:
    text, description, values = _recording(LOST, TWICE)
    recording = read(text, **description, repeats="drop", gaps="mark")
    # Stamps are rounded to a microsecond: the rate over 7.5 s is known to 1e-6 / 7.5.
    assert recording.rate_hz == pytest.approx(RATE_HZ, rel=3e-7)
    found = samples(recording)
    np.testing.assert_array_equal(found, values)
    assert "4 rows repeat" in warnings(recording)
    assert "23 samples are missing in 3 places" in warnings(recording)
    clock = recording.source["clock"]
    assert (clock["repeated_rows"], clock["lost_samples"]) == (4, 23)
    assert clock["places"][0] == {"after_row": 703, "lost": 20}


def test_units_of_degrees_become_the_scale_of_the_channel() -> None:
    text, description, _ = _recording([], [])
    channel = read(text, **description).channels[0]
    assert (channel.unit, channel.scale) == ("rad/s", pytest.approx(np.pi / 180.0, rel=1e-15))


def test_equal_values_of_one_stamp_are_no_repeats_where_values_hardly_change() -> None:
    # A coarse clock shares stamps among rows; a channel at rest in whole counts repeats its value all the time.
    rows = [(f"{np.floor(i / 4) / 25:.2f}", 5, -3, 0) for i in range(1000)]
    recording = read(
        table(["t", "a", "b", "c"], rows), time_column="t", channels=triad("gyro", ["a", "b", "c"], "count")
    )
    assert recording.count == 1000
    assert recording.rate_hz == pytest.approx(100.0, rel=1e-3)
