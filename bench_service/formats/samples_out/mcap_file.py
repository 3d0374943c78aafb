"""A sheet as an MCAP file of `sensor_msgs/msg/Imu`, written in whole chunks, which rosbags writes message by message.

Records by the format's specification, version 0: header, schema, channel, metadata, chunks with the index of their
messages, end of data, and a summary with schema, channel, statistics and the index of chunks.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any
from zlib import crc32

import numpy as np
import pyarrow as pa

from bench_service.formats.samples_out.ros_imu import DEFINITION, MESSAGE, TYPE, columns_of, imu_messages
from bench_service.formats.samples_out.sheet import Sheet
from procedures.core.errors import BadParameter

MAGIC = b"\x89MCAP0\r\n"
TOPIC, PROFILE, LIBRARY = "/imu", "ros2", "bench"
BEGAN = "began_utc"
"""Fact of a sheet that names the moment from which stamps count, where it is known."""
ROWS = 8192
"""Messages of a chunk: 3 MB before compression."""
HEADER, FOOTER, SCHEMA, CHANNEL, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = 1, 2, 3, 4, 6, 7, 8
STATISTICS, METADATA, METADATA_INDEX, DATA_END = 0x0B, 0x0C, 0x0D, 0x0F
RECORD = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
        ("data", MESSAGE),
    ]
)
INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])


@dataclass(frozen=True)
class _Chunk:
    """Place of a chunk in the file, for the summary."""

    first_ns: int
    last_ns: int
    offset: int
    length: int
    index_length: int
    compressed: int
    size: int


def mcap(sheet: Sheet) -> Iterator[bytes]:
    """Yield the bytes of a file. Raises `BadParameter`, before the first, for a sheet without a whole triad in SI."""
    names = [c.name for c in sheet.columns]
    gyro, accelerometer = columns_of(names, "gyro", "rad_per_s"), columns_of(names, "accelerometer", "m_per_s2")
    if gyro is None and accelerometer is None:
        allowed = (
            "csv, parquet, h5 or mat: a message of an IMU holds whole triads in rad/s and m/s², so values=physical"
        )
        raise BadParameter("format", "mcap", allowed)
    return _file(sheet, gyro, accelerometer)


def _file(sheet: Sheet, gyro: list[int] | None, accelerometer: list[int] | None) -> Iterator[bytes]:
    head = MAGIC + _record(HEADER, _string(PROFILE) + _string(LIBRARY)) + _schema() + _channel(sheet)
    facts = _record(METADATA, _string(LIBRARY) + _map(sheet.about))
    listed = _record(METADATA_INDEX, struct.pack("<QQ", len(head), len(facts)) + _string(LIBRARY))
    head += facts
    yield head
    place, chunks, written = len(head), list[_Chunk](), 0
    began = sheet.about.get(BEGAN)
    base = 0 if began is None else round(datetime.fromisoformat(began).timestamp() * 1e6) * 1000
    for block in sheet.blocks:
        for start in range(0, len(block[0]), ROWS):
            rows = [column[start : start + ROWS] for column in block]
            stamps = base + np.rint(rows[0] * 1e9).astype(np.int64)
            triads = [None if at is None else np.column_stack([rows[i] for i in at]) for at in (gyro, accelerometer)]
            data, chunk = _chunk(imu_messages(stamps, *triads), stamps, written, place)
            yield data
            place, written = place + len(data), written + len(stamps)
            chunks.append(chunk)
    yield _end(_schema() + _channel(sheet) + listed, chunks, place + len(_DATA_END), written)


def _chunk(messages: np.ndarray, stamps: np.ndarray, sequence: int, place: int) -> tuple[bytes, _Chunk]:
    """A chunk of messages and the index of them."""
    records = np.zeros(len(messages), RECORD)
    records["opcode"] = 5
    records["length"] = RECORD.itemsize - 9
    records["channel"] = 1
    records["sequence"] = sequence + np.arange(len(messages))
    records["log_time"] = records["publish_time"] = stamps
    records["data"] = messages
    plain = records.tobytes()
    packed = pa.compress(plain, codec="zstd", asbytes=True)
    first, last = int(stamps.min()), int(stamps.max())
    body = struct.pack("<QQQI", first, last, len(plain), crc32(plain)) + _string("zstd")
    chunk = _record(CHUNK, body + struct.pack("<Q", len(packed)) + packed)
    entries = np.zeros(len(messages), INDEX_ENTRY)
    entries["time"], entries["offset"] = stamps, np.arange(len(messages)) * RECORD.itemsize
    index = _record(MESSAGE_INDEX, struct.pack("<HI", 1, entries.nbytes) + entries.tobytes())
    return chunk + index, _Chunk(first, last, place, len(chunk), len(index), len(packed), len(plain))


_DATA_END = struct.pack("<BQI", DATA_END, 4, 0)


def _end(repeated: bytes, chunks: list[_Chunk], summary_start: int, messages: int) -> bytes:
    """End of the data, summary with the `repeated` records, and footer."""
    first, last = min((c.first_ns for c in chunks), default=0), max((c.last_ns for c in chunks), default=0)
    counts = struct.pack("<QHIIIIQQ", messages, 1, 1, 0, 1, len(chunks), first, last)
    summary = repeated + b"".join(map(_chunk_index, chunks))
    summary += _record(STATISTICS, counts + struct.pack("<IHQ", 10, 1, messages))
    footer = struct.pack("<BQQQ", FOOTER, 20, summary_start, 0)
    checked = crc32(summary + footer)
    return _DATA_END + summary + footer + struct.pack("<I", checked) + MAGIC


def _chunk_index(one: _Chunk) -> bytes:
    offsets = struct.pack("<IHQ", 10, 1, one.offset + one.length)
    body = struct.pack("<QQQQ", one.first_ns, one.last_ns, one.offset, one.length) + offsets
    body += struct.pack("<Q", one.index_length) + _string("zstd") + struct.pack("<QQ", one.compressed, one.size)
    return _record(CHUNK_INDEX, body)


def _schema() -> bytes:
    text = DEFINITION.encode()
    body = struct.pack("<H", 1) + _string(TYPE) + _string("ros2msg") + struct.pack("<I", len(text)) + text
    return _record(SCHEMA, body)


def _channel(sheet: Sheet) -> bytes:
    """The channel with the facts of the sheet, which programs that write bags anew keep with it."""
    return _record(CHANNEL, struct.pack("<HH", 1, 1) + _string(TOPIC) + _string("cdr") + _map(sheet.about))


def _record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def _string(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def _map(facts: Mapping[str, Any]) -> bytes:
    data = b"".join(_string(name) + _string(str(value)) for name, value in facts.items())
    return struct.pack("<I", len(data)) + data
