"""ULog, DataFlash and IMR: genuine logs against the format's own reader, and layouts worked by hand."""

import struct
from pathlib import Path

import numpy as np
import pytest
from pyulog import ULog

from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs import ulog
from tests.formats import frame_files
from tests.formats.reading import FORCES, RATES, ROWS, proposed, read, require_motion

GENUINE = ["sample_appended_multiple", "sample_log_small", "sample_logging_tagged_and_default_params"]


@pytest.mark.shared_data
@pytest.mark.parametrize("name", GENUINE)
def test_every_topic_of_genuine_logs_equals_what_pyulog_reads(shared_data: Path, name: str) -> None:
    path = shared_data / "formats" / "ulog" / f"{name}.ulg"
    theirs = ULog(str(path))
    with path.open("rb") as stream:
        ours = ulog.opened(stream, name)
        tables = {table.name: table for table in ours.tables()}
        assert sorted(tables) == sorted(f"{d.name}[{d.multi_id}]" for d in theirs.data_list)
        for data in theirs.data_list:
            table = tables[f"{data.name}[{data.multi_id}]"]
            names = [column.name for column in table.columns]
            for column, parts in zip(names, zip(*ours.rows(table, names), strict=True), strict=True):
                np.testing.assert_array_equal(np.concatenate(parts), data.data[column])


@pytest.mark.shared_data
def test_a_log_with_every_third_row_missing_says_so(shared_data: Path) -> None:
    data = (shared_data / "formats" / "ulog" / f"{GENUINE[2]}.ulg").read_bytes()
    proposal = proposed(data)
    assert proposal.table == "sensor_combined[0]"
    assert proposal.rate_hz == pytest.approx(250.0)
    assert any("665 samples are missing in 665 places" in words for words in proposal.suspicious)
    old = proposed((shared_data / "formats" / "ulog" / f"{GENUINE[0]}.ulg").read_bytes())
    assert any("gyro_integral_dt is float32: seconds" in words for words in old.notes)


def _message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def _ulog(fifo: bool) -> bytes:
    """A ULog of two instances of one topic, or of a FIFO of eight samples a message."""
    found = ulog.MAGIC + struct.pack("<BQ", 1, 1000)
    found += _message("B", bytes(40))
    if not fifo:
        found += _message("F", b"sensor_gyro:uint64_t timestamp;uint64_t timestamp_sample;float x;float y;float z;")
        for instance in (0, 1):
            found += _message("A", struct.pack("<BH", instance, instance + 3) + b"sensor_gyro")
        for row in range(ROWS):
            for instance, sign in ((0, 1.0), (1, -1.0)):
                times = struct.pack("<QQ", 10_000_000 + 5000 * row + 300, 10_000_000 + 5000 * row)
                values = struct.pack("<3f", *(sign * RATES[row]))
                found += _message("D", struct.pack("<H", instance + 3) + times + values)
        return found
    fields = "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float dt;float scale;uint8_t samples;"
    axes = "".join(f"int16_t[8] {axis};" for axis in "xyz") + "uint8_t[3] _padding0;"
    found += _message("F", f"sensor_gyro_fifo:{fields}{axes}".encode())
    found += _message("A", struct.pack("<BH", 0, 7) + b"sensor_gyro_fifo")
    for start in range(0, ROWS, 6):
        counts = np.zeros((3, 8), "<i2")
        counts[:, :6] = np.rint(RATES[start : start + 6].T / 1e-4)
        newest = 10_000_000 + 5000 * (start + 5)
        head = struct.pack("<QQIffB", newest + 900, newest, 1, 5000.0, 1e-4, 6)
        found += _message("D", struct.pack("<H", 7) + head + counts.tobytes())
    return found


def test_instances_are_apart_and_both_clocks_are_kept(tmp_path: Path) -> None:
    data = _ulog(fifo=False)
    path = tmp_path / "a.ulg"
    path.write_bytes(data)
    assert len(ULog(str(path)).data_list) == 2  # the format's own reader takes the file
    for table, sign in (("sensor_gyro[0]", 1.0), ("sensor_gyro[1]", -1.0)):
        proposal = proposed(data, table=table)
        assert proposal.description["time_column"] == "timestamp_sample"
        recording, values = read(data, proposal.description)
        np.testing.assert_array_equal(values, sign * RATES.astype(np.float32))
        assert recording.rate_hz == pytest.approx(200.0, rel=1e-12)
        assert recording.source["second_clock"]["column"] == "timestamp"


def test_a_fifo_is_unrolled_with_its_own_step_and_scale(tmp_path: Path) -> None:
    data = _ulog(fifo=True)
    path = tmp_path / "a.ulg"
    path.write_bytes(data)
    assert ULog(str(path)).data_list[0].data["x[5]"][0] == round(RATES[5, 0] / 1e-4)
    proposal = proposed(data)
    recording, values = read(data, proposal.description)
    assert (recording.count, recording.rate_hz) == (ROWS, pytest.approx(200.0, rel=1e-9))
    np.testing.assert_allclose(values, RATES, atol=0.51e-4)
    assert any("FIFO batches are unrolled" in words for words in proposal.notes)


def test_mutated_ulogs_are_refused_or_read_as_far_as_they_go() -> None:
    data = _ulog(fifo=False)
    cut = proposed(data[:-20])
    assert cut.rows in (ROWS, ROWS - 1)
    assert any("in the middle of a message, as after a loss of power" in words for words in cut.suspicious)
    with pytest.raises(UnreadableFile, match="is a ULog of version 7; versions 0 and 1 are read"):
        proposed(data[:7] + b"\x07" + data[8:])
    at = data.index(b"sensor_gyro:") - 1
    with pytest.raises(UnreadableFile, match=rf"byte {at - 2} is not the start of a message of a ULog \(type 1\)"):
        proposed(data[:at] + b"\x01" + data[at + 1 :])
    with pytest.raises(UnreadableFile, match="uses a newer feature of ULog"):
        proposed(data[:16] + _message("B", bytes(8) + b"\x06" + bytes(31)) + data[59:])


def test_a_dataflash_log_by_hand_with_two_instances() -> None:
    data = frame_files.dataflash()
    proposal, _ = require_motion(data, 5e-7, table="IMU[0]")
    assert proposal.format == "dataflash"
    assert any("left out without a filter" in words for words in proposal.notes)
    second, values = read(data, proposed(data, table="IMU[1]").description)
    np.testing.assert_allclose(values[:, :3], -RATES, atol=5e-7)
    assert second.rate_hz == pytest.approx(200.0, rel=1e-9)


def test_bursts_of_a_dataflash_log_are_recordings_of_their_own() -> None:
    data = frame_files.dataflash()
    names = [t.name for t in proposed(data).tables]
    assert names[-2:] == ["burst 5 of gyro[0]", "burst 6 of accelerometer[0]"]
    for name, truth, step in ((names[-2], RATES, 1e-3), (names[-1], FORCES, 1e-2)):
        recording, values = read(data, proposed(data, table=name).description)
        assert (recording.count, recording.rate_hz) == (128, pytest.approx(1000.0, rel=1e-9))
        np.testing.assert_allclose(values, truth[:128], atol=0.51 * step)
    lost = data[: -(3 + 12 + 192) * 2]
    with pytest.raises(UnreadableFile, match=r"burst 6 of accelerometer\[0\]: 64 of 128 samples are there"):
        read(lost, proposed(data, table=names[-1]).description)


def test_mutated_dataflash_logs() -> None:
    data = frame_files.dataflash(bursts=False)
    spoilt = proposed(data[: 89 * 4] + b"\x01\x02\x03" + data[89 * 4 :])
    assert any(
        f"3 bytes belong to no message and were skipped, the first at byte {89 * 4}" in w for w in spoilt.suspicious
    )
    cut = proposed(data[:-10])
    assert any("the log is cut off in the message at byte" in words for words in cut.suspicious)
    wrong = bytearray(data)
    wrong[89 + 4] = 41
    with pytest.raises(UnreadableFile, match="its definition of IMU gives 41 bytes, its fields have 40"):
        proposed(bytes(wrong))


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("increments", [False, True])
def test_an_imr_file_by_hand(order: str, increments: bool) -> None:
    data = frame_files.imr(order, increments)
    proposal, recording = require_motion(data, 0.51e-6, increments=increments)
    assert proposal.format == "imr"
    assert recording.source["clock"]["lost_samples"] == 0
    assert any("angles are taken as deg" in words for words in proposal.unknown)


def test_an_imr_file_whose_factors_are_reciprocals_is_questioned() -> None:
    data = bytearray(frame_files.imr())
    data[33:49] = struct.pack("<dd", 1e7, 1e6)
    proposal, _ = require_motion(bytes(data), 0.51e-6, increments=True)
    assert any("some writers put the reciprocal there" in words for words in proposal.unknown)


def test_mutated_imr_files() -> None:
    data = frame_files.imr()
    cut = proposed(data[:-7])
    assert any(f"cut off in the record at byte {len(data) - 32}" in words for words in cut.suspicious)
    with pytest.raises(
        UnreadableFile, match="is cut off at byte 300: the header of an IMR file from byte 0 on needs 512"
    ):
        proposed(data[:300])
    with pytest.raises(UnreadableFile, match="its header has the rate"):
        proposed(data[:8] + b"\x01" + data[9:])
    with pytest.raises(UnreadableFile, match="byte 8 says the byte order 9"):
        proposed(data[:8] + b"\x09" + data[9:])
