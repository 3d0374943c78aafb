"""Reader of MCAP files with ROS messages, chunk by chunk.

Layout: the MCAP specification (magic, then records of uint8 opcode and uint64 length). Read from the beginning to the
end of the data, so that a file without its summary is read as far as it goes.
"""

import struct
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import BinaryIO

from bench_service.formats.bounds import MEGABYTE, quoted
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.bytes_at import size_of
from bench_service.formats.logs.ros.batches import Batches
from bench_service.formats.logs.ros.definitions import full_name, parsed
from bench_service.formats.logs.ros.messages import Decoder, Topic
from bench_service.formats.logs.ros.unpacked import unpacked
from bench_service.formats.logs.table import LogTable, Numbers

NAME = "mcap"
TITLE = "MCAP (ROS 2 or ROS 1)"
MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_SCHEMA, _CHANNEL, _MESSAGE_OP, _CHUNK, _STATISTICS, _METADATA, _DATA_END = 3, 4, 5, 6, 11, 12, 15
LARGEST_CHUNK = 128 * MEGABYTE
MOST_FACTS = 1000
"""Most pairs of one map of metadata that are taken."""
_ENCODINGS = {"cdr": ("ros2msg", "ros2idl"), "ros1": ("ros1msg",)}


def begins(start: bytes) -> bool:
    """Return whether a file that begins so is an MCAP."""
    return start.startswith(MAGIC)


def opened(stream: BinaryIO, name: str) -> "Mcap":
    """Return a reader of an MCAP file. Raises `UnreadableFile`."""
    return Mcap(stream, name)


class Mcap:
    """Reader of one MCAP file with ROS messages, record by record. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream, self._name = stream, name
        self.warnings: list[str] = []
        self._size = size_of(stream)
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._channels: dict[int, Topic] = {}
        self.facts: dict[str, str] = {}
        """Metadata of the file and of its channels, as far as they stand before the first message of each topic."""
        self.column_facts: dict[str, dict[str, str]] = {}
        self._scan()

    def _scan(self) -> None:
        """Find all channels, their first messages and their counts. Raises `UnreadableFile`."""
        counts = self._statistics()
        seen: dict[int, int] = {}
        waiting = set(counts) if counts is not None else None
        for channel, _, _, data in self._messages(None):
            topic = self._channels.get(channel)
            if topic is not None and topic.first is None:
                topic.first = bytes(data)
            seen[channel] = seen.get(channel, 0) + 1
            if waiting is not None:
                waiting.discard(channel)
                if not waiting:
                    break
        for number, topic in self._channels.items():
            topic.rows = (counts if counts is not None else seen).get(number, 0)

    def _statistics(self) -> dict[int, int] | None:
        """Return the number of messages of each channel, from the summary; None: there is none."""
        tail = 8 + 4 + 8 + 8 + 9
        if self._size < len(MAGIC) + tail:
            return None
        self._stream.seek(self._size - tail)
        footer = self._stream.read(tail)
        if footer[-8:] != MAGIC or footer[0] != 2:
            return None
        begin = struct.unpack_from("<Q", footer, 9)[0]
        if not 0 < begin < self._size:
            return None
        self._stream.seek(begin)
        for opcode, body in self._records(begin, self._size - tail):
            if opcode == _STATISTICS and len(body) >= 46:
                entries = body[46:]
                found = {
                    channel: count
                    for channel, count in (
                        struct.unpack_from("<HQ", entries, k) for k in range(0, len(entries) - 9, 10)
                    )
                    if count
                }
                return found or None
        return None

    def _records(self, begin: int, end: int) -> Iterator[tuple[int, bytes]]:
        """Yield the records between two places; a record that is cut off ends them with a warning."""
        at = begin
        while at < end:
            self._stream.seek(at)
            head = self._stream.read(9)
            if len(head) < 9:
                self._cut(at)
                return
            opcode, length = _HEAD.unpack(head)
            if opcode == _DATA_END:
                yield opcode, b""
                return
            if length > LARGEST_CHUNK + MEGABYTE and at + 9 + length <= self._size:
                if opcode in (_CHUNK, _MESSAGE_OP):
                    raise UnreadableFile(
                        self._name,
                        f"the record at byte {at} has {length} bytes, at most {LARGEST_CHUNK // MEGABYTE} MB are read",
                    )
                at += 9 + length
                continue
            body = self._stream.read(length) if at + 9 + length <= self._size else b""
            if at + 9 + length > self._size:
                self._cut(at)
                return
            yield opcode, body
            at += 9 + length

    def _cut(self, at: int) -> None:
        words = (
            f"the file is cut off in the record at byte {at}, as when its recorder was killed: what is before was read"
        )
        if words not in self.warnings:
            self.warnings.append(words)

    def _messages(self, wanted: frozenset[int] | None) -> Iterator[tuple[int, int, int, bytes | memoryview]]:
        """Yield channel, log time, publish time [ns] and data of the messages of some channels, or of all."""
        begun = False
        for opcode, body in self._records(len(MAGIC), self._size):
            if opcode == _DATA_END:
                return
            if not begun and opcode != 1:
                raise UnreadableFile(
                    self._name, f"byte {len(MAGIC)} is not the start of a header record of an MCAP: it is damaged"
                )
            begun = True
            if opcode == _CHUNK:
                yield from self._inner(self._chunk(body), wanted)
            elif opcode == _MESSAGE_OP:
                yield from self._one(memoryview(body), wanted)
            elif opcode in (_SCHEMA, _CHANNEL):
                self._define(opcode, body)
            elif opcode == _METADATA:
                self._state(body)

    def _chunk(self, body: bytes) -> memoryview:
        try:
            size, _crc, length = struct.unpack_from("<QII", body, 16)
            compression = body[32 : 32 + length].decode("ascii")
            packed = memoryview(body)[32 + length + 8 :]
        except (struct.error, UnicodeDecodeError) as error:
            raise UnreadableFile(self._name, "has a chunk whose head is damaged") from error
        if size > LARGEST_CHUNK:
            raise UnreadableFile(
                self._name, f"has a chunk of {size} bytes, at most {LARGEST_CHUNK // MEGABYTE} MB are unpacked at once"
            )
        return memoryview(unpacked(packed, compression, size, self._name))

    def _inner(
        self, data: memoryview, wanted: frozenset[int] | None
    ) -> Iterator[tuple[int, int, int, bytes | memoryview]]:
        at, end = 0, len(data)
        unpack, message, size = _HEAD.unpack_from, _MESSAGE.unpack_from, _MESSAGE.size
        while at + 9 <= end:
            opcode, length = unpack(data, at)
            at += 9
            stop = at + length
            if stop > end:
                raise UnreadableFile(self._name, "a chunk ends in the middle of a record: it is damaged")
            if opcode == _MESSAGE_OP and length >= size:
                channel, _, logged, published = message(data, at)
                if wanted is None or channel in wanted:
                    yield channel, logged, published, data[at + size : stop]
            elif opcode in (_SCHEMA, _CHANNEL):
                self._define(opcode, bytes(data[at:stop]))
            at = stop

    def _one(
        self, body: memoryview, wanted: frozenset[int] | None
    ) -> Iterator[tuple[int, int, int, bytes | memoryview]]:
        if len(body) >= _MESSAGE.size:
            channel, _, logged, published = _MESSAGE.unpack_from(body)
            if wanted is None or channel in wanted:
                yield channel, logged, published, body[_MESSAGE.size :]

    def _define(self, opcode: int, body: bytes) -> None:
        number = int.from_bytes(body[:2], "little")
        try:
            if opcode == _SCHEMA and number not in self._schemas:
                title, at = _text(body, 2)
                encoding, at = _text(body, at)
                length = struct.unpack_from("<I", body, at)[0]
                self._schemas[number] = (title, encoding, body[at + 4 : at + 4 + length].decode("utf-8", "replace"))
            elif opcode == _CHANNEL and number not in self._channels:
                schema = int.from_bytes(body[2:4], "little")
                topic, at = _text(body, 4)
                encoding, at = _text(body, at)
                self._channels[number] = self._topic(topic, encoding, schema)
                self.facts = _pairs(body, at) | self.facts
        except (struct.error, IndexError) as error:
            raise UnreadableFile(self._name, "has a schema or a channel that is damaged") from error

    def _state(self, body: bytes) -> None:
        """Take a record of metadata; one that is damaged says nothing."""
        with suppress(struct.error):
            _, at = _text(body, 0)
            self.facts |= _pairs(body, at)

    def _topic(self, topic: str, encoding: str, schema: int) -> Topic:
        title, kind, text = self._schemas.get(schema, ("", "", ""))
        found = Topic(topic, full_name(title), None, encoding == "cdr", publish=True)
        if kind not in _ENCODINGS.get(encoding, ()):
            found.problem = f"messages of the encoding {quoted(encoding)} with schemas of {quoted(kind)} are not read"
            return found
        found.types = parsed(text, title, kind, self._name)
        if found.types is None:
            found.problem = f"the definition of {quoted(title)} cannot be parsed"
        return found

    def tables(self) -> list[LogTable]:
        """Return the topics that have messages as tables."""
        return [topic.table() for topic in self._channels.values() if topic.rows != 0]

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of a topic's messages: for each named column its values, (n,). Raises `UnreadableFile`."""
        wanted = frozenset(number for number, topic in self._channels.items() if topic.name == table.name)
        if not wanted:
            return
        decoder = Decoder(self._channels[min(wanted)], columns, self._name)
        batches = Batches(decoder)
        for _, logged, published, data in self._messages(wanted):
            yield from batches.add(data, logged, published)
        yield from batches.rest()


def _text(body: bytes, at: int) -> tuple[str, int]:
    length = struct.unpack_from("<I", body, at)[0]
    return body[at + 4 : at + 4 + length].decode("utf-8", "replace"), at + 4 + length


def _pairs(body: bytes, at: int) -> dict[str, str]:
    """A map of texts from a place on; what is too long for its record is left out."""
    if at + 4 > len(body):
        return {}
    end = min(len(body), at + 4 + struct.unpack_from("<I", body, at)[0])
    at, found = at + 4, dict[str, str]()
    while at + 8 <= end and len(found) < MOST_FACTS:
        key, at = _text(body, at)
        if at + 4 > end:
            break
        found[key], at = _text(body, at)
    return found
