"""Sums of several samples in a row, one row lost: the loss is placed, and the rate is that of the sums."""

import numpy as np
import pytest

from tests.cases.tables import chance, read, refusal, table


def test_a_lost_row_is_placed() -> None:
    counts = np.rint(chance(13).normal(9.8 / 100 / 2e-8, 1e4, 12_000)).astype(int)
    rows = [(f"{(2 * i + 1) / 200:.4f}", count) for i, count in enumerate(counts)]
    channel = {
        "name": "accelerometer_z",
        "column": "dvz",
        "quantity": "velocity_increment",
        "unit": "m/s",
        "scale": 2e-8,
    }
    asked = {"time_column": "t", "channels": [channel]}
    whole = read(table(["t", "dvz"], rows), **asked)
    assert whole.rate_hz == pytest.approx(100.0, rel=1e-9)
    words = refusal(table(["t", "dvz"], rows[:5000] + rows[5001:]), **asked)
    assert "at 100 Hz 1 sample is missing in 1 place: 1 between rows 5000 and 5001" in words
