"""Accumulated angle or velocity as the input: its steps become increments, over wraps, and gaps stay gaps."""

import numpy as np
import pytest

from tests.cases.tables import chance, read, refusal, samples, table

RATES = chance(21).normal(1.0, 0.2, 1000)
"""deg/s at 10 Hz."""
ANGLE = np.concatenate([[12.0], 12.0 + np.cumsum(RATES) / 10.0])
CHANNEL = {"name": "gyro_x", "column": "angle", "quantity": "angle", "unit": "deg"}


def test_an_angle_becomes_increments() -> None:
    rows = [(f"{i / 10:.1f}", repr(a)) for i, a in enumerate(ANGLE.tolist())]
    recording = read(table(["t", "angle"], rows), time_column="t", channels=[CHANNEL])
    assert (recording.count, recording.rate_hz) == (1000, pytest.approx(10.0))
    channel = recording.channels[0]
    assert (channel.quantity.value, channel.unit) == ("angle_increment", "rad")
    rates = samples(recording)[:, 0] * channel.scale * recording.rate_hz
    # A difference of doubles near 120: 1.4e-14 deg each, times 10 Hz.
    np.testing.assert_allclose(rates, np.radians(RATES), atol=1e-14)


def test_an_angle_that_begins_again_is_carried_on() -> None:
    turning = np.rint(ANGLE * 37.0 * 1000.0).astype(int) % 360_000  # 10 turns in whole thousandths of a degree
    text = table(["angle"], [(a,) for a in turning])
    channel = {**CHANNEL, "scale": 0.001, "period": 360_000}
    recording = read(text, rate_hz=10.0, channels=[channel])
    assert recording.dtype is np.int32
    np.testing.assert_array_equal(samples(recording)[:, 0], np.diff(np.rint(ANGLE * 37.0 * 1000.0).astype(int)))
    lost = read(text, rate_hz=10.0, channels=[{**channel, "period": None}])
    assert samples(lost).min() < -300_000


def test_a_velocity_in_g_seconds_with_counts_of_any_size() -> None:
    counts = 2**40 + np.cumsum(np.arange(100) % 7)
    column = {"name": "accelerometer_x", "column": "v", "quantity": "velocity", "unit": "g*s", "scale": 1e-6}
    recording = read(table(["v"], [(c,) for c in counts]), rate_hz=100.0, channels=[column])
    assert recording.dtype is np.int32
    np.testing.assert_array_equal(samples(recording)[:, 0], np.diff(counts))
    assert recording.channels[0].scale == pytest.approx(9.80665e-6, rel=1e-15)


def test_the_step_over_a_gap_is_no_increment() -> None:
    kept = np.delete(np.arange(len(ANGLE)), [500, 501])
    rows = [(f"{i / 10:.1f}", repr(float(ANGLE[i]))) for i in kept]
    recording = read(table(["t", "angle"], rows), time_column="t", channels=[CHANNEL], gaps="mark")
    found = samples(recording)[:, 0]
    assert len(found) == 1000
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(found)), [499, 500, 501])


def test_empty_cells_are_gaps_where_that_is_asked_for() -> None:
    text = "x,y\n1,2\n,3\n4,nan\n5,6\n"
    channels = [{"name": n, "column": n, "quantity": "angular_rate", "unit": "rad/s"} for n in ("x", "y")]
    words = refusal(text, rate_hz=100.0, channels=channels)
    assert "line 3, column 'x': '' where a finite number was expected" in words
    assert 'gaps = "mark" takes an empty or NaN cell as a gap' in words
    recording = read(text, rate_hz=100.0, channels=channels, gaps="mark")
    np.testing.assert_array_equal(samples(recording), [[1, 2], [np.nan, 3], [4, np.nan], [5, 6]])
    assert recording.source["warnings"] == ["2 cells are empty or NaN and were taken as gaps"]


def test_a_period_is_for_what_is_accumulated() -> None:
    with pytest.raises(ValueError, match="period is for the quantities angle and velocity"):
        read("x\n1\n", rate_hz=1.0, channels=[{**CHANNEL, "quantity": "angular_rate", "unit": "rad/s", "period": 360}])
