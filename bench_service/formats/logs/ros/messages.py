"""Serialised ROS messages as columns: fields at fixed offsets are taken out of many messages at once.

Definitions are parsed by rosbags; CDR (ROS 2) and the packed form of ROS 1 are laid out here. All messages whose
variable lengths (``frame_id``, sequences) equal those of the first share its offsets; numpy does the rest.
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import numpy as np

from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.names import hint
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable, Numbers, triad
from procedures.core.recording import Quantity

_CODES = {
    "bool": "u1",
    "byte": "u1",
    "char": "u1",
    "octet": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
_TIMES = ("builtin_interfaces/msg/Time",)
MOST_LEAVES = 4096
LOG_TIME, PUBLISH_TIME = "log_time", "publish_time"
_REP = "REP 103 and REP 145: rad/s and m/s²"
_STAMP = "header.stamp: the sender's clock; many drivers put the time of arrival there"

Types = Mapping[str, Any]
"""Definitions as rosbags has them: type name -> (constants, fields)."""


@dataclass
class Layout:
    """Places of the numbers in a message. `guards`: place and value of each length that must be the same."""

    order: str
    leaves: dict[str, tuple[str, int]] = field(default_factory=dict[str, tuple[str, int]])
    """Name -> numpy type, offset; a time is there under its own name as ("time", offset)."""
    guards: list[tuple[int, int]] = field(default_factory=list[tuple[int, int]])
    size: int = 0


class Undecodable(Exception):
    """Raised where a message does not fit its definition."""


class _Walk:
    """Lays out one message."""

    def __init__(self, types: Types, data: bytes, cdr: bool) -> None:
        self.types, self.data, self.cdr = types, data, cdr
        self.origin = self.at = 4 if cdr else 0
        order = "<"
        if cdr:
            if len(data) < 4 or data[0] != 0 or data[1] not in (0, 1):
                raise Undecodable("its encapsulation is not plain CDR")
            order = "<" if data[1] else ">"
        self.layout = Layout(order)

    def walk(self, type_name: str, prefix: str = "", depth: int = 0) -> None:
        """Lay out a message type from the present place on. Raises `Undecodable`."""
        if type_name not in self.types or depth > 12:
            raise Undecodable(f"there is no definition of {type_name}")
        if type_name in _TIMES:
            self._align(4)
            self.layout.leaves[prefix.rstrip(".")] = ("time", self.at)
        for name, node in self.types[type_name][1]:
            self._node(node, prefix + name, depth)

    def _node(self, node: Any, name: str, depth: int) -> None:
        kind, detail = int(node[0]), node[1]
        if kind == 1:
            self._base(detail[0], name)
        elif kind == 2:
            self.walk(detail, f"{name}.", depth + 1)
        else:
            inner, count = detail
            if kind == 4:
                count = self._length()
            self._many(inner, int(count), name, depth)

    def _many(self, inner: Any, count: int, name: str, depth: int) -> None:
        if int(inner[0]) == 1 and inner[1][0] in _CODES and len(self.layout.leaves) + count > MOST_LEAVES:
            size = int(_CODES[inner[1][0]][1])
            if count:
                self._align(size)
            self.at += count * size
            self._require_inside()
            return
        for index in range(count):
            if len(self.layout.leaves) > 2 * MOST_LEAVES:
                raise Undecodable("it has too many fields")
            self._node(inner, f"{name}[{index}]", depth + 1)

    def _base(self, kind: str, name: str) -> None:
        if kind == "string":
            length = self._length()
            self.at += length
            self._require_inside()
            return
        code = _CODES.get(kind)
        if code is None:
            raise Undecodable(f"fields of the type {kind} are not read")
        size = int(code[1])
        self._align(size)
        self.layout.leaves[name] = (self.layout.order + code, self.at)
        self.at += size
        self._require_inside()

    def _length(self) -> int:
        self._align(4)
        place = self.at
        self.at += 4
        self._require_inside()
        value = struct.unpack_from(f"{self.layout.order}I", self.data, place)[0]
        if value > len(self.data):
            raise Undecodable("a length in it is larger than itself")
        self.layout.guards.append((place, value))
        return value

    def _align(self, size: int) -> None:
        if self.cdr:
            self.at += -(self.at - self.origin) % size

    def _require_inside(self) -> None:
        if self.at > len(self.data):
            raise Undecodable("it is shorter than its definition")


def lay_out(types: Types, type_name: str, data: bytes, cdr: bool) -> Layout:
    """Return the places of all numbers in a message of a type. Raises `Undecodable`. `cdr`: the encoding is that of ROS
    2; False: that of ROS 1.
    """
    walk = _Walk(types, data, cdr)
    walk.walk(type_name)
    walk.layout.size = walk.at
    return walk.layout


@dataclass
class Topic:
    """A topic of a bag: its name and type, its definitions, its number of messages, and a first message."""

    name: str
    type_name: str
    types: Types | None
    cdr: bool
    rows: int | None = None
    first: bytes | None = None
    problem: str = ""
    """Why its messages cannot be read; empty: they can."""
    publish: bool = False
    """Whether messages have a time of publication in addition to that of arrival."""

    def table(self) -> LogTable:
        """Return the topic's description as a table, with its columns and clocks."""
        received = LogClock(LOG_TIME, 1e-9, "the recorder's clock at the arrival of the message")
        clocks = [received]
        if self.publish:
            clocks.append(LogClock(PUBLISH_TIME, 1e-9, "the publisher's clock at sending"))
        if self.problem or self.types is None or self.first is None:
            return LogTable(self.name, (), tuple(clocks), None, self.rows, (self.problem or "no message",))
        try:
            layout = lay_out(self.types, self.type_name, self.first, self.cdr)
        except Undecodable as error:
            return LogTable(self.name, (), tuple(clocks), None, self.rows, (f"cannot be read: {error}",))
        times = [name for name, (code, _) in layout.leaves.items() if code == "time"]
        clocks = [
            *(
                LogClock(name, 1e-9, _STAMP if name == "header.stamp" else "a time field of the message")
                for name in times
            ),
            *clocks,
        ]
        names = [name for name, (code, _) in layout.leaves.items() if code != "time"]
        known = self._known(names)
        columns = tuple(known.get(name, LogColumn(name)) for name in names)
        notes = (f"type {self.type_name}",)
        return LogTable(self.name, columns, tuple(clocks), None, self.rows, notes)

    def _known(self, names: Sequence[str]) -> dict[str, LogColumn]:
        if self.type_name == "sensor_msgs/msg/Imu":
            columns = triad(
                [f"angular_velocity.{a}" for a in "xyz"], "gyro", Quantity.ANGULAR_RATE, "rad/s", source=_REP
            ) + triad(
                [f"linear_acceleration.{a}" for a in "xyz"],
                "accelerometer",
                Quantity.SPECIFIC_FORCE,
                "m/s^2",
                source=_REP,
            )
            return {column.name: column for column in columns}
        found: dict[str, LogColumn] = {}
        for name in names:
            guess = hint(name)
            if guess.quantity is not None and "covariance" not in name:
                found[name] = LogColumn(
                    name,
                    guess.quantity,
                    guess.unit,
                    channel=guess.channel,
                    source="the name of the field",
                    doubt=guess.doubt,
                )
        return found


class Decoder:
    """Decodes messages of one topic into columns, as many at a time as are given."""

    def __init__(self, topic: Topic, columns: Sequence[str], file: str) -> None:
        self._topic, self._columns, self._file = topic, columns, file
        self._layouts: dict[int, list[Layout]] = {}
        self._done = 0

    def decode(
        self, messages: Sequence[bytes | memoryview], received: Numbers, published: Numbers
    ) -> Iterator[list[Numbers]]:
        """Yield blocks of columns, (n,) each, messages of one length together and in order. Raises `UnreadableFile`."""
        at = 0
        for size, group in groupby(messages, len):
            part = list(group)
            rows = slice(at, at + len(part))
            at += len(part)
            data = np.frombuffer(b"".join(part), np.uint8).reshape(len(part), size)
            yield from self._same_length(data, received[rows], published[rows])
        self._done += len(messages)

    def _same_length(self, data: Any, received: Numbers, published: Numbers) -> Iterator[list[Numbers]]:
        start = 0
        while start < len(data):
            layout = self._layout(bytes(data[start]))
            fits = np.ones(len(data) - start, bool)
            for place, value in layout.guards:
                words = data[start:, place : place + 4].copy().view(layout.order + "u4")[:, 0]
                fits &= words == value
            if layout.order != "<" or (data.shape[1] > 1 and self._topic.cdr):
                fits &= data[start:, 1] == data[start, 1]
            stop = start + (int(np.argmin(fits)) if not fits.all() else len(fits))
            rows = data[start:stop]
            yield [
                self._column(name, layout, rows, received[start:stop], published[start:stop]) for name in self._columns
            ]
            start = stop

    def _layout(self, message: bytes) -> Layout:
        for known in self._layouts.get(len(message), ()):
            if all(struct.unpack_from(f"{known.order}I", message, p)[0] == v for p, v in known.guards):
                return known
        try:
            found = lay_out(self._topic.types or {}, self._topic.type_name, message, self._topic.cdr)
        except Undecodable as error:
            raise UnreadableFile(
                self._file, f"a message of {self._topic.name} after the first {self._done} cannot be read: {error}"
            ) from error
        self._layouts.setdefault(len(message), []).append(found)
        return found

    def _column(self, name: str, layout: Layout, rows: Any, received: Numbers, published: Numbers) -> Numbers:
        if name == LOG_TIME:
            return received
        if name == PUBLISH_TIME:
            return published
        if name not in layout.leaves:
            raise UnreadableFile(
                self._file, f"a message of {self._topic.name} after the first {self._done} has no field {name!r}"
            )
        code, at = layout.leaves[name]
        if code == "time":
            words = rows[:, at : at + 8].copy().view(layout.order + "u4").astype(np.int64)
            return words[:, 0] * 1_000_000_000 + words[:, 1]
        size = np.dtype(code).itemsize
        column = rows[:, at : at + size].copy().view(code)[:, 0]
        return column.astype(code[1:]) if layout.order == ">" else column
