"""ROS 1 and ROS 2 bags of rosbags' writers read to the motion that was written, with both clocks."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.ros.batches import Batches
from bench_service.formats.logs.ros.messages import Decoder, Topic
from tests.formats.reading import RATES, TIMES_NS, proposed, read, require_motion
from tests.formats.ros_files import IMU, LATE_NS, bag1, bag2

PACKED1 = (None, Writer1.CompressionFormat.BZ2, Writer1.CompressionFormat.LZ4)


@pytest.fixture(scope="module")
def mcap(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return bag2(tmp_path_factory.mktemp("bag") / "mcap", StoragePlugin.MCAP)


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return bag2(tmp_path_factory.mktemp("bag") / "db", StoragePlugin.SQLITE3)


def test_an_mcap(mcap: bytes) -> None:
    proposal, recording = require_motion(mcap, 0.0)
    assert (proposal.format, proposal.table) == ("mcap", "/imu/data")
    assert [c.column for c in proposal.clocks] == ["header.stamp", "log_time", "publish_time"]
    assert proposal.description["time_column"] == "header.stamp"
    assert recording.source["second_clock"]["column"] == "log_time"
    assert {t.name for t in proposal.tables} == {"/imu/data", "/temperature"}
    assert proposal.unknown == []


def test_a_database(database: bytes) -> None:
    proposal, _ = require_motion(database, 0.0)
    assert (proposal.format, proposal.table) == ("rosbag2", "/imu/data")
    assert [c.column for c in proposal.clocks] == ["header.stamp", "log_time"]


@pytest.mark.parametrize("packed", PACKED1)
def test_a_bag_of_ros_1(tmp_path: Path, packed: Writer1.CompressionFormat | None) -> None:
    proposal, _ = require_motion(bag1(tmp_path / "one.bag", packed), 0.0)
    assert proposal.format == "rosbag1"


@pytest.mark.parametrize(
    ("plugin", "mode"),
    [(StoragePlugin.SQLITE3, CompressionMode.MESSAGE), (StoragePlugin.MCAP, CompressionMode.STORAGE)],
)
def test_a_bag_of_ros_2_that_is_packed(tmp_path: Path, plugin: StoragePlugin, mode: CompressionMode) -> None:
    require_motion(bag2(tmp_path / "bag", plugin, packed=mode), 0.0)


def test_stamps_are_those_of_sender_and_recorder(mcap: bytes, database: bytes) -> None:
    for data in (mcap, database):
        description = proposed(data).description
        by_recorder = {**description, "time_column": "log_time", "second_time_column": None}
        for asked, late in ((description, 0), (by_recorder, LATE_NS)):
            recording, _ = read(data, asked)
            assert recording.rate_hz == pytest.approx(200.0, rel=1e-9)
            assert recording.source["clock"]["lost_samples"] == 0
            assert late in (0, LATE_NS)
    assert TIMES_NS[1] - TIMES_NS[0] == 5_000_000


def test_messages_whose_frame_changes_are_read_all_the_same(tmp_path: Path) -> None:
    """A longer frame_id moves every field; runs of one layout are decoded apart and stay in order."""
    data = bag2(tmp_path / "b", StoragePlugin.MCAP, frames=lambda row: "imu" if row % 7 else "a_longer_frame")
    require_motion(data, 0.0)


def test_another_topic_by_its_name(mcap: bytes) -> None:
    proposal = proposed(mcap, table="/temperature")
    assert [c.channel for c in proposal.columns] == ["temperature"]
    assert proposal.columns[0].mean == pytest.approx(25.0 + 250.0)
    with pytest.raises(UnreadableFile, match=r"there is no table '/imu'; it has /temperature, /imu/data"):
        proposed(mcap, table="/imu")


@pytest.mark.parametrize(
    ("column", "problem"),
    [
        ("gyro", r"table '/imu/data' has no column 'gyro'; the columns are header\.stamp, log_time"),
        (99, r"table '/imu/data' has no column 99; it has \d+ columns, numbered from 0"),
        (-1, r"table '/imu/data' has no column -1; it has \d+ columns, numbered from 0"),
    ],
)
def test_a_column_that_a_topic_does_not_have_is_refused(mcap: bytes, column: str | int, problem: str) -> None:
    description = proposed(mcap).description
    first, *others = description["channels"]
    with pytest.raises(UnreadableFile, match=problem):
        read(mcap, {**description, "channels": [{**first, "column": column}, *others]})


def test_a_cut_bag_is_read_as_far_as_it_goes_and_says_so(tmp_path: Path) -> None:
    data = bag1(tmp_path / "one.bag", None, chunk_bytes=20_000)
    cut = data[: len(data) * 2 // 3]
    proposal = proposed(cut)
    assert any("is cut off in the record at byte" in words for words in proposal.suspicious)
    recording, values = read(cut, proposal.description)
    assert 200 < recording.count < 500
    np.testing.assert_array_equal(values[:, :3], RATES[: recording.count])
    assert any("cut off in the record at byte" in words for words in recording.source["warnings"])


def test_an_mcap_that_is_cut_in_its_only_chunk_says_so(mcap: bytes) -> None:
    with pytest.raises(UnreadableFile, match=r"no table of samples; the file is cut off in the record at byte \d+"):
        proposed(mcap[: len(mcap) * 2 // 3])


def test_mutated_bags_are_refused_with_the_place(mcap: bytes, database: bytes, tmp_path: Path) -> None:
    with pytest.raises(UnreadableFile, match="byte 8 is not the start of a header record of an MCAP"):
        proposed(mcap[:8] + b"\x09" + mcap[9:])
    with pytest.raises(UnreadableFile, match=r"the database cannot be read|cannot be read as an SQLite database"):
        read(database[: len(database) // 2], proposed(database).description)
    with pytest.raises(UnreadableFile, match="is an SQLite database but not a ROS 2 bag"):
        proposed(_other_database(tmp_path / "other.db"))
    bag = bag1(tmp_path / "one.bag", None)
    with pytest.raises(UnreadableFile, match=r"is a bag of #ROSBAG V1.2; version 2.0 is read"):
        proposed(b"#ROSBAG V1.2\n" + bag[13:])
    with pytest.raises(UnreadableFile, match="byte 13 is not the start of a record of a bag"):
        proposed(bag[:13] + b"\xff" * 8 + bag[21:])


def _other_database(path: Path) -> bytes:
    import sqlite3

    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE things (name TEXT)")
    database.close()
    return path.read_bytes()


def test_messages_that_wait_keep_no_chunk_alive() -> None:
    """A chunk with images is a thousand times its message of an IMU; a buffer that is seen cannot be resized."""
    chunk = bytearray(1_000_000)
    batches = Batches(Decoder(Topic("/imu", IMU, None, cdr=True), [], "a"))
    assert list(batches.add(memoryview(chunk)[:324], 0)) == []
    chunk.clear()
