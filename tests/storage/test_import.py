"""Recorded files come in whole and true, or are refused with the file, the row and what was expected."""

import gzip
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bench_service.campaigns.stores import Stores
from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.import_file import ImportedRecording, ImportFile, read_import
from bench_service.model.records import NewRecording
from procedures.core.errors import BadParameter, UnfitRecording

GYRO_X = {"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "rad/s"}
GYRO_Y = {**GYRO_X, "name": "gyro_y", "column": "y"}


def _description(**changes: Any) -> ImportDescription:
    given: dict[str, Any] = {"unit": "U-1", "channels": [GYRO_X, GYRO_Y], "rate_hz": 100.0}
    return ImportDescription.model_validate({**given, **changes})


def _read(text: str | bytes, **changes: Any) -> ImportedRecording:
    data = text if isinstance(text, bytes) else text.encode()
    return read_import([ImportFile("a.csv", io.BytesIO(data))], _description(**changes))


def _samples(recording: ImportedRecording) -> np.ndarray[Any, Any]:
    return np.concatenate(list(recording.blocks()))


def _timed(times: list[float]) -> str:
    return "t,x,y\n" + "".join(f"{t!r},{i},{-i}\n" for i, t in enumerate(times))


def test_columns_are_found_by_name_or_index_in_any_order() -> None:
    text = "made by hand\nt,y,x\n0.00,1,2\n0.01,3,4\n0.02,5,6\n"
    by_name = _read(text, header_lines=1)
    by_index = _read(text, header_lines=2, header=False, channels=[{**GYRO_X, "column": 2}, {**GYRO_Y, "column": 1}])
    for recording in (by_name, by_index):
        assert recording.dtype is np.int32
        assert (recording.rate_hz, recording.count) == (100.0, 3)
        np.testing.assert_array_equal(_samples(recording), [[2, 1], [4, 3], [6, 5]])
    assert by_name.source["files"][0]["name"] == "a.csv"
    assert by_name.source["files"][0]["bytes"] == len(text)
    assert by_name.source["description"]["channels"][0]["unit"] == "rad/s"


@pytest.mark.parametrize("delimiter", [",", ";", "tab", "whitespace"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("last", [False, True])
def test_text_in_all_its_dress(delimiter: str, newline: str, packed: bool, last: bool) -> None:
    between = {"tab": "\t", "whitespace": "   "}.get(delimiter, delimiter)
    rows = [["x", "y"], ["  1.5", "-2e0"], [" 3", "+4"], ["5.25e+00 ", "6"]]
    text = newline.join(between.join(row) for row in rows) + (newline if last else "")
    data = gzip.compress(text.encode()) if packed else text.encode()
    recording = _read(data, delimiter=delimiter)
    assert recording.dtype is np.float64
    np.testing.assert_array_equal(_samples(recording), [[1.5, -2], [3, 4], [5.25, 6]])


def test_a_file_longer_than_a_block_is_read_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench_service.formats.delimited._BLOCK_BYTES", 1000)
    raw = np.arange(20_000).reshape(-1, 2)
    text = "x,y\n" + "".join(f"{x},{y}\n" for x, y in raw)
    np.testing.assert_array_equal(_samples(_read(text)), raw)


@pytest.mark.parametrize("form", ["parquet", "arrow", "stream"])
def test_columnar_files(form: str) -> None:
    table = pa.table(
        {"t": np.arange(5) * 10, "y": np.arange(5, dtype=np.int16), "x": np.arange(5) * 0.5, "s": ["a"] * 5}
    )
    sink = io.BytesIO()
    if form == "parquet":
        pq.write_table(table, sink)
    else:
        writer = (pa.ipc.new_file if form == "arrow" else pa.ipc.new_stream)(sink, table.schema)
        with writer:
            writer.write_table(table)
    ask = {"time_column": "t", "time_unit": "ms"}
    np.testing.assert_array_equal(
        _samples(_read(sink.getvalue(), **ask)), np.column_stack([np.arange(5) * 0.5, np.arange(5)])
    )
    with pytest.raises(UnreadableFile, match="'s' is of type string"):
        _read(sink.getvalue(), channels=[{**GYRO_X, "column": "s"}])
    with pytest.raises(UnreadableFile, match="has no column 'z'"):
        _read(sink.getvalue(), channels=[{**GYRO_X, "column": "z"}])
    with pytest.raises(UnreadableFile, match="has no column -1; it has 4 columns, numbered from 0"):
        _read(sink.getvalue(), channels=[{**GYRO_X, "column": -1}])
    with pytest.raises(UnreadableFile, match=r"a\.csv: cannot be read"):
        _read(sink.getvalue()[:200])


def test_an_empty_cell_of_a_columnar_file_is_named() -> None:
    sink = io.BytesIO()
    pq.write_table(pa.table({"x": [1.0, None, 3.0], "y": [1, 2, 3]}), sink)
    with pytest.raises(UnreadableFile, match="row 2, column 'x'"):
        _read(sink.getvalue())


def test_jitter_within_the_tolerance_is_no_gap() -> None:
    rng = np.random.Generator(np.random.PCG64(3))
    times = np.arange(500) * 0.01 + rng.uniform(-0.0009, 0.0009, 500)
    recording = _read(_timed(times.tolist()), time_column="t", rate_hz=None)
    assert recording.rate_hz == pytest.approx(100.0, rel=1e-3)


def test_files_are_joined_as_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench_service.formats.delimited._BLOCK_BYTES", 100)

    def files(second: str) -> list[ImportFile]:
        first = "t,x\n" + "".join(f"{i / 100},{i}\n" for i in range(300))
        return [ImportFile("a.csv", io.BytesIO(first.encode())), ImportFile("b.csv", io.BytesIO(second.encode()))]

    description = _description(time_column="t", channels=[{**GYRO_Y, "file": 1}, GYRO_X])
    whole = "t,other,y\n" + "".join(f"{i / 100 + 1e-5:.6f},1.5,{-i}\n" for i in range(300))
    joined = read_import(files(whole), description)
    np.testing.assert_array_equal(_samples(joined), np.column_stack([-np.arange(300), np.arange(300)]))
    assert [f["name"] for f in joined.source["files"]] == ["a.csv", "b.csv"]

    lines = whole.splitlines(keepends=True)
    with pytest.raises(UnreadableFile, match=r"a\.csv has 300, b\.csv has 250"):
        read_import(files("".join(lines[:251])), description)
    shifted = "t,other,y\n" + "".join(f"{i / 100 + 0.004:.6f},1.5,{-i}\n" for i in range(300))
    with pytest.raises(UnfitRecording, match=r"b\.csv: row 1 is of 0.004 s, in a\.csv of 0 s"):
        read_import(files(shifted), description)
    with pytest.raises(BadParameter, match="every one of the 2 files"):
        read_import(files(whole), _description(channels=[GYRO_X]))


def _store(stores: Stores, imported: ImportedRecording) -> str:
    writer = stores.recordings.open(
        NewRecording(
            unit=imported.description.unit,
            channels=imported.channels,
            rate_hz=imported.rate_hz,
            start_s=imported.description.start_s,
            simulated=False,
            dtype=imported.dtype,
            source=imported.source,
        )
    )
    for block in imported.blocks():
        writer.write(block)
    return writer.seal().id


def _triad(kind: str, file: int, columns: list[str] | list[int]) -> list[dict[str, Any]]:
    quantity = {"gyro": "angular_rate", "accelerometer": "specific_force"}[kind]
    return [
        {"name": f"{kind}_{axis}", "column": column, "file": file, "quantity": quantity, "unit": "count"}
        for axis, column in zip("xyz", columns, strict=True)
    ]


@pytest.mark.shared_data
def test_a_real_multi_position_recording(
    stores: Stores, shared_data: Path, new_recording: Callable[..., NewRecording]
) -> None:
    folder = shared_data / "xsens_multi_position"
    names = ("xsens_acc.txt.gz", "xsens_gyro.txt.gz")
    description = ImportDescription.model_validate(
        {
            "unit": "xsens",
            "header": False,
            "delimiter": "whitespace",
            "time_column": 0,
            "rate_hz": 100.0,
            "channels": _triad("accelerometer", 0, [1, 2, 3]) + _triad("gyro", 1, [1, 2, 3]),
        }
    )
    with (folder / names[0]).open("rb") as first, (folder / names[1]).open("rb") as second:
        imported = read_import([ImportFile(names[0], first), ImportFile(names[1], second)], description)
        recording = stores.recordings.load(_store(stores, imported))
    assert recording.info.count == 51_175
    raw = np.concatenate(list(recording.blocks()))
    assert raw.dtype == np.int32
    expected = [np.loadtxt(io.BytesIO(gzip.decompress((folder / name).read_bytes())))[:, 1:] for name in names]
    np.testing.assert_array_equal(raw, np.hstack(expected))


@pytest.mark.shared_data
@pytest.mark.parametrize(("name", "rows"), [("static_449s.csv.gz", 44_930), ("ten_positions.csv.gz", 10_245)])
def test_a_real_static_recording(stores: Stores, shared_data: Path, name: str, rows: int) -> None:
    file = shared_data / "mpu6050_static" / name
    description = ImportDescription.model_validate(
        {
            "unit": "mpu6050",
            "header_lines": 4,
            "rate_hz": 100.0,
            "channels": _triad("gyro", 0, ["gx", "gy", "gz"]) + _triad("accelerometer", 0, ["ax", "ay", "az"]),
        }
    )
    with file.open("rb") as stream:
        imported = read_import([ImportFile(name, stream)], description)
        recording = stores.recordings.load(_store(stores, imported))
    raw = np.concatenate(list(recording.blocks()))
    assert raw.shape == (rows, 6)
    expected = np.loadtxt(io.BytesIO(gzip.decompress(file.read_bytes())), delimiter=",", skiprows=5)
    np.testing.assert_array_equal(raw, expected[:, [3, 4, 5, 0, 1, 2]])
