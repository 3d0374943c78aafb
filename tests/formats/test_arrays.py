"""MATLAB, HDF5 and TDMS files of scipy, h5py and npTDMS read to the motion that was written."""

import io
import tempfile
from pathlib import Path
from typing import Any

import h5py
import nptdms
import numpy as np
import pytest

from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.arrays_by_name.hdf5 import opened
from tests.formats.packed_files import mat_file
from tests.formats.reading import FORCES, RATES, ROWS, proposed, read, require_motion

TIME_S = np.arange(ROWS) * 0.005


@pytest.mark.parametrize("packed", [False, True])
def test_a_mat_file_of_version_5_with_matrices_in_a_struct(packed: bool) -> None:
    content = {"imu": {"acc": FORCES, "gyro": RATES, "t": TIME_S}, "note": "at rest"}
    proposal, recording = require_motion(mat_file(content, do_compression=packed), 0.0)
    assert proposal.format == "mat5"
    assert proposal.description["time_column"] == "imu.t"
    assert any("unit of the gyros" in words for words in proposal.unknown)
    assert any("taken as m/s^2 (the mean of |f|" in words for words in proposal.notes)
    assert recording.dtype is np.float64


@pytest.mark.parametrize("packed", [False, True])
def test_whole_doubles_that_matlab_stores_small_keep_their_sign(packed: bool) -> None:
    """A double class stored as int8 or uint16 comes back as numbers that do not wrap."""
    counts = np.array([[0.0, 100.0, -128.0]] * 4) - np.arange(4)[:, None]
    data = mat_file(
        {"gyro": counts.astype(np.int16), "wide": np.full((4, 1), 60_000, np.uint16)}, do_compression=packed
    )
    description = {"unit": "U", "rate_hz": 10.0, "channels": [_count("gyro[0]"), _count("gyro[2]"), _count("wide")]}
    _, values = read(data, description)
    np.testing.assert_array_equal(values, np.column_stack([counts[:, 0], counts[:, 2], np.full(4, 60_000.0)]))


def _count(column: str) -> dict[str, Any]:
    name = "c" + "".join(letter for letter in column if letter.isalnum())
    return {"name": name, "column": column, "quantity": "angular_rate", "unit": "count"}


@pytest.mark.parametrize("room", ["memory", "temporary file", "none", "no space"])
def test_a_packed_matrix_is_read_wherever_it_is_unpacked(room: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """In memory where it is small, else in a temporary file, else, or where the disk is full, piece by piece."""
    source = "bench_service.formats.logs.arrays_by_name.mat5_source"
    if room != "memory":
        monkeypatch.setattr(f"{source}.WHOLE_BYTES", 1000)
    if room == "none":
        monkeypatch.setattr(f"{source}.SPOOLED_BYTES", 1000)
    if room == "no space":
        full = lambda: Path("/dev/full").open("wb", buffering=0)  # noqa: E731, SIM115
        monkeypatch.setattr(f"{source}.tempfile.TemporaryFile", full)
    monkeypatch.setattr("bench_service.formats.logs.arrays_by_name.mat5.BLOCK_ROWS", 77)
    content = {"imu": {"acc": FORCES, "gyro": RATES, "t": TIME_S}}
    require_motion(mat_file(content, do_compression=True), 0.0)


def test_a_mat_file_longer_than_a_block_is_read_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench_service.formats.logs.arrays_by_name.mat5.BLOCK_ROWS", 7)
    monkeypatch.setattr("bench_service.formats.logs.arrays_by_name.mat5_source._PIECE", 100)
    for packed in (False, True):
        require_motion(mat_file({"gyro": RATES, "acc": FORCES, "t": TIME_S}, do_compression=packed), 0.0)


def test_mutated_mat_files_are_refused_with_the_place() -> None:
    data = mat_file({"gyro": RATES, "acc": FORCES, "t": TIME_S}, do_compression=True)
    at = len(data) - 500
    with pytest.raises(UnreadableFile, match=rf"is cut off at byte {at}: the variable at byte \d+ needs"):
        proposed(data[:at])
    with pytest.raises(UnreadableFile, match=r"byte 128 is not the start of a variable \(type 99\)"):
        proposed(data[:128] + b"\x63" + data[129:])
    broken = bytearray(data)
    broken[300:340] = bytes(40)
    with pytest.raises(UnreadableFile, match=r"is damaged|cannot be unpacked"):
        proposed(bytes(broken))


def test_tables_of_matlab_are_refused_with_the_way_out() -> None:
    with pytest.raises(UnreadableFile, match="holds no matrix of samples: 'words' is text"):
        proposed(mat_file({"words": "nothing else"}, do_compression=False))


@pytest.mark.parametrize("chunks", [None, (64, 3)])
def test_an_hdf5_file_with_units_as_attributes(chunks: tuple[int, int] | None) -> None:
    sink = io.BytesIO()
    with h5py.File(sink, "w") as file:
        options = {} if chunks is None else {"chunks": chunks, "compression": "gzip"}
        file.create_dataset("imu/gyro", data=np.rad2deg(RATES), **options).attrs["units"] = "deg/s"
        file.create_dataset("imu/accel", data=FORCES / 9.80665, **options).attrs["units"] = "g"
        file["imu/time_ns"] = np.arange(ROWS, dtype=np.int64) * 5_000_000
    proposal, _ = require_motion(sink.getvalue(), 1e-14)
    assert proposal.format == "hdf5"
    assert proposal.unknown == []
    assert proposal.description["time_unit"] == "ns"


def test_an_hdf5_file_without_a_name_is_read() -> None:
    """An upload is spooled to a temporary file that has no name: HDF5 2.0 cannot resolve the link to it."""
    with tempfile.TemporaryFile() as spooled:
        with h5py.File(spooled, "w") as file:
            file["imu/gyro"] = RATES
        spooled.seek(0)
        assert opened(spooled, "upload.h5").tables()[0].columns[0].name == "imu/gyro[0]"


def test_a_mat_file_of_version_73_is_stored_transposed() -> None:
    """MATLAB stores an n-by-3 matrix as 3-by-n with its class as an attribute, behind 512 bytes of its own."""
    sink = io.BytesIO()
    with h5py.File(sink, "w", userblock_size=512) as file:
        for name, matrix in (("imu/gyro", RATES), ("imu/acc", FORCES), ("imu/t", TIME_S[:, None])):
            file.create_dataset(name, data=matrix.T).attrs["MATLAB_class"] = np.bytes_("double")
        empty = file.create_dataset("imu/mag", data=np.array([0, 3], np.uint64))
        empty.attrs["MATLAB_class"], empty.attrs["MATLAB_empty"] = np.bytes_("double"), np.uint8(1)
    proposal, _ = require_motion(sink.getvalue(), 0.0)
    assert proposal.description["time_column"] == "imu.t"
    assert "imu.mag" not in proposal.tables[0].columns


def test_mutated_hdf5_files_are_refused() -> None:
    sink = io.BytesIO()
    with h5py.File(sink, "w") as file:
        file["gyro"] = RATES
    with pytest.raises(UnreadableFile, match="cannot be read as HDF5: it is cut off"):
        proposed(sink.getvalue()[:-3000])


def _tdms(path: Path, segments: int = 3) -> bytes:
    columns = {f"Gyro {a}": ("deg/s", np.rad2deg(RATES[:, i])) for i, a in enumerate("XYZ")}
    columns |= {f"Accel {a}": ("m/s^2", FORCES[:, i]) for i, a in enumerate("XYZ")}
    size = ROWS // segments
    with nptdms.TdmsWriter(path) as writer:
        for k in range(segments):
            part = slice(k * size, (k + 1) * size)
            writer.write_segment(
                [
                    nptdms.ChannelObject("IMU", name, values[part], {"wf_increment": 0.005, "unit_string": unit})
                    for name, (unit, values) in columns.items()
                ]
            )
    return path.read_bytes()


def test_a_tdms_file_in_segments(tmp_path: Path) -> None:
    proposal, _ = require_motion(_tdms(tmp_path / "a.tdms"), 1e-14)
    assert proposal.format == "tdms"
    assert proposal.rate_hz == pytest.approx(200.0)
    assert any("wf_increment" in words for words in proposal.notes)


def test_mutated_tdms_files_are_refused(tmp_path: Path) -> None:
    data = _tdms(tmp_path / "a.tdms")
    with pytest.raises(UnreadableFile, match="holds no channel with more than one value"):
        proposed(data[:10])
    cut = proposed(data[:-1000])
    assert any("the last segment of the file is cut off" in words for words in cut.suspicious)
    broken = bytearray(data)
    broken[len(data) // 3 : len(data) // 3 + 4000] = bytes(4000)
    with pytest.raises(UnreadableFile, match="TDMS"):
        read(bytes(broken), proposed(data).description)
