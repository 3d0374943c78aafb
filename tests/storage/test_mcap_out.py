"""MCAP with `sensor_msgs/Imu`: read back by rosbags, by the format's own library, and by our importer."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from bench_service.formats.logs.ros import mcap as our_reader
from bench_service.formats.samples_out.mcap_file import BEGAN, ROWS
from bench_service.formats.samples_out.ros_imu import DEFINITION
from bench_service.formats.samples_out.sheet import physical_sheet, raw_sheet
from bench_service.formats.samples_out.sheet_files import SheetFormat, written
from procedures.core.errors import BadParameter
from tests.kit.sample_sheets import RATE, blocks, part_of, sheet, values

START = "2026-11-30T08:00:00.250000+00:00"
TYPES = get_typestore(Stores.ROS2_HUMBLE)


def made(began: str | None = None, **part: int) -> bytes:
    one = sheet(**part)
    about = one.about if began is None else {**one.about, BEGAN: began}
    return b"".join(written(replace(one, about=about), SheetFormat.MCAP))


def by_rosbags(data: bytes, folder: Path) -> tuple[np.ndarray, np.ndarray, list]:
    """Log times, stamps [ns] and messages."""
    (folder / "one.mcap").write_bytes(data)
    reader = McapReader(folder / "one.mcap")
    reader.open()
    found = [
        (at, TYPES.deserialize_cdr(raw, "sensor_msgs/msg/Imu")) for _, at, raw in reader.messages(reader.connections)
    ]
    reader.close()
    stamps = np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for _, m in found])
    return np.array([at for at, _ in found]), stamps, [m for _, m in found]


def test_rosbags_reads_the_samples_with_their_stamps(tmp_path: Path) -> None:
    at, stamps, messages = by_rosbags(made(START), tmp_path)
    base = 1796025600_250000000  # 2026-11-30T08:00:00.25Z, by `date -u +%s`
    assert stamps.tolist() == at.tolist() == [base + round(i * 1e9 / RATE) for i in range(1000)]
    rates = np.array([[m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z] for m in messages])
    forces = np.array([[m.linear_acceleration.x, m.linear_acceleration.y, m.linear_acceleration.z] for m in messages])
    np.testing.assert_allclose(np.column_stack([rates, forces]), values()[:, :6], rtol=1e-15)
    one = messages[-1]
    assert (one.header.frame_id, one.orientation.w, one.orientation_covariance[0]) == ("imu", 1.0, -1.0)
    assert not np.any(one.angular_velocity_covariance)


def test_the_format_s_own_library_finds_schema_index_and_checksums() -> None:
    reader = make_reader(io.BytesIO(made()), validate_crcs=True)
    summary = reader.get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert (summary.statistics.message_count, len(summary.chunk_indexes)) == (1000, -(-1000 // 137))
    assert {s.name: s.encoding for s in summary.schemas.values()} == {"sensor_msgs/msg/Imu": "ros2msg"}
    assert summary.schemas[1].data.decode() == DEFINITION
    late = [m for _, _, m in reader.iter_messages(starting_at=int(2.4e9))]  # by the index of chunks
    assert [m.sequence for m in late] == list(range(960, 1000))
    (facts,) = reader.iter_metadata()
    assert (facts.name, facts.metadata["recording"], facts.metadata["simulated"]) == ("bench", "r-1", "true")


def test_a_type_s_definition_is_that_of_ros() -> None:
    """rosbags has the fields of each release's messages."""
    found = get_types_from_msg(DEFINITION, "sensor_msgs/msg/Imu")
    assert found["sensor_msgs/msg/Imu"] == TYPES.fielddefs["sensor_msgs/msg/Imu"]


def test_a_single_triad_says_that_the_other_is_absent(tmp_path: Path) -> None:
    part = part_of(channels=["gyro_x", "gyro_y", "gyro_z"])
    data = b"".join(written(physical_sheet(part, blocks(part)), SheetFormat.MCAP))
    _, stamps, messages = by_rosbags(data, tmp_path)
    assert stamps[:2].tolist() == [0, 2_500_000], "without a moment, stamps count from the first sample"
    assert (messages[0].linear_acceleration_covariance[0], messages[0].angular_velocity_covariance[0]) == (-1.0, 0.0)


def test_our_own_import_finds_the_samples_again() -> None:
    log = our_reader.opened(io.BytesIO(made()), "one.mcap")
    (table,) = [t for t in log.tables() if t.name == "/imu"]
    names = [c.name for c in table.columns]
    blocks_read = [np.column_stack([np.asarray(c, dtype=float) for c in block]) for block in log.rows(table, names)]
    rows = np.concatenate(blocks_read)
    by_name = dict(zip(names, rows.T, strict=True))
    np.testing.assert_allclose(by_name["angular_velocity.y"], values()[:, 1], rtol=1e-15)


def test_what_no_message_can_hold_is_refused() -> None:
    part = part_of()
    with pytest.raises(BadParameter, match="values=physical"):
        written(raw_sheet(part, blocks(part)), SheetFormat.MCAP)
    part = part_of(channels=["gyro_x", "gyro_y", "temperature_case"])
    with pytest.raises(BadParameter, match="whole triads"):
        written(physical_sheet(part, blocks(part)), SheetFormat.MCAP)


def test_long_blocks_are_cut_into_chunks() -> None:
    n = 2 * ROWS + 5
    one = sheet()
    block = tuple(np.arange(n, dtype=np.float64) / RATE if i == 0 else np.full(n, float(i)) for i in range(8))
    data = b"".join(written(replace(one, rows=n, blocks=[block]), SheetFormat.MCAP))
    summary = make_reader(io.BytesIO(data)).get_summary()
    assert summary is not None
    assert len(summary.chunk_indexes) == 3
