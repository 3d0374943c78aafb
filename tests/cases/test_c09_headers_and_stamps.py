"""Marks before names, text columns, stamps of nanoseconds and of types, stamps of arrival beside the sensor's own."""

import io
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.cases.tables import chance, read, samples, table, triad, warnings

FIRST_NS = 1403636579758555392
ROWS = 2000


def _rates(rows: int = ROWS) -> np.ndarray[Any, Any]:
    return chance(9).normal(0.0, 0.002, (rows, 3)).round(9)


def test_names_after_a_mark() -> None:
    stamps = FIRST_NS + 5_000_000 * np.arange(ROWS)
    names = ["#timestamp [ns]", "w_x [rad s^-1]", "w_y [rad s^-1]", "w_z [rad s^-1]"]
    text = table(names, [(t, *w) for t, w in zip(stamps, _rates(), strict=True)])
    for name in ("timestamp [ns]", "#timestamp [ns]"):
        recording = read(text, time_column=name, time_unit="ns", channels=triad("gyro", names[1:], "rad/s"))
        assert recording.rate_hz == pytest.approx(200.0, rel=1e-12)
        assert recording.source["warnings"] == []
    np.testing.assert_array_equal(samples(recording), _rates())


def test_stamps_of_arrival_beside_those_of_the_sensor_and_a_column_of_text() -> None:
    own = FIRST_NS + 5_000_000 * np.arange(ROWS)
    late = np.sort(own + chance(3).integers(200_000, 4_800_000, ROWS))
    names = ["%time", "field.header.stamp", "field.header.frame_id", "field.angular_velocity.x"]
    text = table(names, [(a, b, "imu_link", w[0]) for a, b, w in zip(late, own, _rates(), strict=True)])
    gyro = [{"name": "gyro_x", "column": names[3], "quantity": "angular_rate", "unit": "rad/s"}]
    sensor = read(text, time_column=names[1], time_unit="ns", channels=gyro)
    assert sensor.rate_hz == pytest.approx(200.0, rel=1e-12)
    arrival = read(text, time_column="time", time_unit="ns", channels=gyro)
    # A line through ROWS stamps with a uniform error of 4.6 ms: sd 1.33 ms·√12 / (ROWS^1.5·5 ms) = 1.03e-5; 5 of them.
    assert arrival.rate_hz == pytest.approx(200.0, rel=5.2e-5)
    assert arrival.source["clock"]["lost_samples"] == 0
    assert "jitter" in warnings(arrival)


def test_comments_before_the_names() -> None:
    text = "# made by hand\n% of 2026, in rad/s\n#t,x\n0.00,1\n0.01,2\n0.02,3\n"
    gyro = [{"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "count"}]
    assert read(text, time_column="t", channels=gyro).rate_hz == pytest.approx(100.0)
    nameless = text.replace("#t,x\n", "")
    numbered = read(nameless, time_column=0, header=False, channels=[{**gyro[0], "column": 1}])
    np.testing.assert_array_equal(samples(numbered), [[1], [2], [3]])


@pytest.mark.parametrize("kind", ["integer", "double"])
def test_eight_kilohertz_of_nanoseconds(kind: str) -> None:
    stamps = FIRST_NS + 125_000 * np.arange(20_000)
    # As doubles of seconds since 1970 the stamps have steps of 238 ns, 0.2 % of a period.
    shown = stamps if kind == "integer" else [repr(float(t) * 1e-9) for t in stamps]
    gyro = [{"name": "gyro_x", "column": "gx", "quantity": "angular_rate", "unit": "rad/s"}]
    text = table(["t", "gx"], zip(shown, _rates(20_000)[:, 0], strict=True))
    recording = read(text, time_column="t", time_unit="ns" if kind == "integer" else "s", channels=gyro)
    assert recording.rate_hz == pytest.approx(8000.0, rel=1e-12 if kind == "integer" else 1e-6)
    assert recording.source["warnings"] == []


@pytest.mark.parametrize(
    "stamps",
    [
        lambda ns: pa.array(ns, pa.timestamp("ns")),
        lambda ns: pa.array(ns // 1000, pa.timestamp("us", "UTC")),
        lambda ns: pa.array(ns // 1_000_000, pa.timestamp("ms")),
        lambda ns: pa.array(ns - ns[0], pa.duration("ns")),
        lambda ns: pa.array((ns - ns[0]) // 1_000_000, pa.int32()).cast(pa.time32("ms")),
        lambda ns: pa.array([str(t) for t in ns.astype("datetime64[ns]")]),
    ],
)
@pytest.mark.parametrize("form", ["parquet", "arrow"])
def test_typed_stamps_are_read_in_their_own_unit(stamps: Any, form: str) -> None:
    column = stamps(FIRST_NS + 5_000_000 * np.arange(ROWS))
    data = pa.table({"field.stamp": column, "gx": _rates()[:, 0].astype(np.float32)})
    sink = io.BytesIO()
    if form == "parquet":
        pq.write_table(data, sink)
    else:
        with pa.ipc.new_file(sink, data.schema) as writer:
            writer.write_table(data)
    gyro = [{"name": "gyro_x", "column": "gx", "quantity": "angular_rate", "unit": "rad/s"}]
    unit = "clock" if pa.types.is_string(column.type) else "s"
    recording = read(sink.getvalue(), time_column="field.stamp", time_unit=unit, channels=gyro)
    # Stamps cut to a millisecond: 1 ms over 10 s.
    assert recording.rate_hz == pytest.approx(200.0, rel=1e-4)
    assert recording.count == ROWS
