"""Reader of ROS 1 bags (version 2.0), chunk by chunk.

Layout: the published format of ROS 1 bags (records of a header of named fields and data; little-endian). Read from the
beginning, so that a bag that was never closed is read as far as it goes.
"""

import struct
from collections.abc import Iterator, Sequence
from typing import BinaryIO

from bench_service.formats.bounds import MEGABYTE, quoted
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.bytes_at import exactly, size_of
from bench_service.formats.logs.ros.batches import Batches
from bench_service.formats.logs.ros.definitions import full_name, parsed
from bench_service.formats.logs.ros.messages import Decoder, Topic
from bench_service.formats.logs.ros.unpacked import unpacked
from bench_service.formats.logs.table import LogTable, Numbers

NAME = "rosbag1"
TITLE = "ROS 1 bag"
MAGIC = b"#ROSBAG V2.0\n"
LARGEST_CHUNK = 128 * MEGABYTE
_DATA, _BAG, _CHUNK, _CONNECTION, _CHUNK_INFO = 2, 3, 5, 7, 6

Fields = dict[bytes, bytes]


def begins(start: bytes) -> bool:
    """Return whether a file that begins so is a ROS 1 bag."""
    return start.startswith(b"#ROSBAG")


def opened(stream: BinaryIO, name: str) -> "Bag":
    """Return a reader of a ROS 1 bag. Raises `UnreadableFile`."""
    return Bag(stream, name)


class Bag:
    """Reader of one ROS 1 bag, record by record. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream, self._name = stream, name
        self.warnings: list[str] = []
        self._size = size_of(stream)
        stream.seek(0)
        start = exactly(stream, len(MAGIC), name, "the version of a bag")
        if start != MAGIC:
            words = start.decode("ascii", "replace").strip()
            raise UnreadableFile(name, f"is a bag of {words}; version 2.0 is read: rosbag migrates older ones")
        self._topics: dict[int, Topic] = {}
        self._scan()

    def _scan(self) -> None:
        counts = self._counts()
        waiting = set(counts) if counts else None
        seen: dict[int, int] = {}
        for number, _, data in self._messages(None):
            topic = self._topics.get(number)
            if topic is not None and topic.first is None:
                topic.first = bytes(data)
            seen[number] = seen.get(number, 0) + 1
            if waiting is not None:
                waiting.discard(number)
                if not waiting:
                    break
        for number, topic in self._topics.items():
            topic.rows = (counts or seen).get(number, 0)

    def _counts(self) -> dict[int, int]:
        """Return the number of messages of each connection, from the index; empty where there is none."""
        found: dict[int, int] = {}
        for fields, _, _ in self._records(len(MAGIC), self._size, skip=True):
            begin = int.from_bytes(fields.get(b"index_pos", b""), "little")
            if not 0 < begin < self._size:
                return {}
            for inner, _, data in self._records(begin, self._size, skip=False):
                if inner.get(b"op") == bytes([_CHUNK_INFO]):
                    for place in range(0, len(data) - 7, 8):
                        number, count = struct.unpack_from("<II", data, place)
                        found[number] = found.get(number, 0) + count
                elif inner.get(b"op") == bytes([_CONNECTION]):
                    self._connect(inner, bytes(data))
            return {n: c for n, c in found.items() if c}
        return {}

    def _records(self, begin: int, end: int, skip: bool) -> Iterator[tuple[Fields, int, bytes]]:
        """Yield header fields, place and data of records; a record that is cut off ends them with a warning.

        `skip`: the data are not read.
        """
        at = begin
        while at < end:
            self._stream.seek(at)
            words = self._stream.read(4)
            length = int.from_bytes(words, "little")
            if len(words) < 4 or length > 10 * MEGABYTE:
                self._cut(at, length if len(words) == 4 else None)
                return
            head = self._stream.read(length + 4)
            if len(head) < length + 4:
                self._cut(at, None)
                return
            size = int.from_bytes(head[length:], "little")
            if at + 8 + length + size > self._size:
                self._cut(at, None)
                return
            if size > LARGEST_CHUNK:
                raise UnreadableFile(
                    self._name,
                    f"the record at byte {at} has {size} bytes, at most {LARGEST_CHUNK // MEGABYTE} MB are read",
                )
            fields = self._fields(head[:length], at)
            wanted = not skip and fields.get(b"op") != b"\x04"
            yield fields, at, self._stream.read(size) if wanted else b""
            at += 8 + length + size

    def _cut(self, at: int, length: int | None) -> None:
        if length is not None:
            raise UnreadableFile(
                self._name, f"byte {at} is not the start of a record of a bag: the file is damaged there"
            )
        words = (
            f"the bag is cut off in the record at byte {at}, as when its recorder was killed: what is before was read"
        )
        if words not in self.warnings:
            self.warnings.append(words)

    def _fields(self, head: bytes | memoryview, at: int) -> Fields:
        found: Fields = {}
        place = 0
        while place + 4 <= len(head):
            stop = place + 4 + int.from_bytes(head[place : place + 4], "little")
            key, equals, value = bytes(head[place + 4 : stop]).partition(b"=")
            if not equals or stop > len(head):
                raise UnreadableFile(self._name, f"the header of the record at byte {at} is damaged")
            found[key] = value
            place = stop
        return found

    def _messages(self, wanted: frozenset[int] | None) -> Iterator[tuple[int, int, memoryview]]:
        """Yield connection, time of arrival [ns] and data of the messages of some connections, or of all."""
        for fields, at, data in self._records(len(MAGIC), self._size, skip=False):
            kind = fields.get(b"op", b"\0")[0]
            if kind == _CHUNK:
                size = int.from_bytes(fields.get(b"size", b""), "little")
                if size > LARGEST_CHUNK:
                    raise UnreadableFile(
                        self._name, f"the chunk at byte {at} unpacks to {size} bytes, at most {LARGEST_CHUNK} are read"
                    )
                packing = fields.get(b"compression", b"none").decode("ascii", "replace")
                yield from self._inner(memoryview(unpacked(data, packing, size, self._name)), at, wanted)
            elif kind == _DATA:
                yield from self._one(fields, memoryview(data), wanted)
            elif kind == _CONNECTION:
                self._connect(fields, data)

    def _inner(self, data: memoryview, at: int, wanted: frozenset[int] | None) -> Iterator[tuple[int, int, memoryview]]:
        place, end = 0, len(data)
        known: dict[int, tuple[bytes, int, int]] = {}
        while place + 4 <= end:
            length = int.from_bytes(data[place : place + 4], "little")
            middle = place + 4 + length
            size = int.from_bytes(data[middle : middle + 4], "little")
            stop = middle + 4 + size
            if stop > end:
                raise UnreadableFile(
                    self._name, f"the chunk at byte {at} ends in the middle of a record: it is damaged"
                )
            head = bytes(data[place + 4 : middle])
            template = known.get(length)
            if template is not None and _masked(head, template[1], template[2]) == template[0]:
                number = int.from_bytes(head[template[1] : template[1] + 4], "little")
                if wanted is None or number in wanted:
                    time = head[template[2] : template[2] + 8]
                    yield number, _nanoseconds(time), data[middle + 4 : stop]
            else:
                fields = self._fields(head, at)
                if fields.get(b"op") == bytes([_DATA]):
                    conn, when = head.find(b"\x09\x00\x00\x00conn="), head.find(b"\x0d\x00\x00\x00time=")
                    if conn >= 0 and when >= 0:
                        known[length] = (_masked(head, conn + 9, when + 9), conn + 9, when + 9)
                    yield from self._one(fields, data[middle + 4 : stop], wanted)
                elif fields.get(b"op") == bytes([_CONNECTION]):
                    self._connect(fields, bytes(data[middle + 4 : stop]))
            place = stop

    def _one(
        self, fields: Fields, data: memoryview, wanted: frozenset[int] | None
    ) -> Iterator[tuple[int, int, memoryview]]:
        number = int.from_bytes(fields.get(b"conn", b""), "little")
        if wanted is None or number in wanted:
            yield number, _nanoseconds(fields.get(b"time", b"\0" * 8)), data

    def _connect(self, fields: Fields, data: bytes) -> None:
        number = int.from_bytes(fields.get(b"conn", b""), "little")
        if number in self._topics:
            return
        inner = self._fields(data, 0)
        topic = fields.get(b"topic", b"?").decode("utf-8", "replace")
        title = inner.get(b"type", b"").decode("ascii", "replace")
        text = inner.get(b"message_definition", b"").decode("utf-8", "replace")
        found = Topic(topic, full_name(title), parsed(text, title, "ros1msg", self._name), cdr=False)
        if found.types is None:
            found.problem = f"the definition of {quoted(title)} cannot be parsed"
        self._topics[number] = found

    def tables(self) -> list[LogTable]:
        """Return the topics as tables; connections of one topic are one table."""
        found: dict[str, Topic] = {}
        for topic in self._topics.values():
            if topic.rows == 0:
                continue
            if topic.name in found:
                found[topic.name].rows = (found[topic.name].rows or 0) + (topic.rows or 0)
            else:
                found[topic.name] = topic
        return [topic.table() for topic in found.values()]

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of a topic's messages: for each named column its values, (n,). Raises `UnreadableFile`."""
        wanted = frozenset(number for number, topic in self._topics.items() if topic.name == table.name)
        if not wanted:
            return
        batches = Batches(Decoder(self._topics[min(wanted)], columns, self._name))
        for _, received, data in self._messages(wanted):
            yield from batches.add(data, received)
        yield from batches.rest()


def _masked(head: bytes, conn: int, when: int) -> bytes:
    """A header of a message without the numbers that change."""
    first, second = sorted(((conn, 4), (when, 8)))
    return head[: first[0]] + head[first[0] + first[1] : second[0]] + head[second[0] + second[1] :]


def _nanoseconds(stamp: bytes) -> int:
    seconds, nanoseconds = struct.unpack("<II", stamp[:8].ljust(8, b"\0"))
    return seconds * 1_000_000_000 + nanoseconds
