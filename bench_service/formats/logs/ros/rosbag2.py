"""Reader of ROS 2 bags that are SQLite databases (.db3), row by row.

SQLite reads through the stream itself (a file system of apsw over it), so the file needs no name. Tables: the rosbag2
SQLite schema, `topics` and `messages`, with `message_definitions` in newer ones.
"""

from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO

from bench_service.formats.bounds import quoted
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.optional import needed
from bench_service.formats.logs.ros.batches import Batches
from bench_service.formats.logs.ros.definitions import distribution, full_name, parsed
from bench_service.formats.logs.ros.messages import Decoder, Topic
from bench_service.formats.logs.ros.sqlite_stream import connected
from bench_service.formats.logs.ros.unpacked import ZSTD, unpacked_stream
from bench_service.formats.logs.table import LogTable, Numbers

NAME = "rosbag2"
TITLE = "ROS 2 bag (SQLite)"
MAGIC = b"SQLite format 3\x00"


def begins(start: bytes) -> bool:
    """Return whether a file that begins so is an SQLite database."""
    return start.startswith(MAGIC)


def opened(stream: BinaryIO, name: str) -> "Database":
    """Return a reader of a ROS 2 bag in SQLite. Raises `UnreadableFile`."""
    return Database(stream, name)


class Database:
    """Reader of one ROS 2 bag in SQLite; of one file of it, where it was split. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._name = name
        self.warnings: list[str] = []
        self._apsw = needed("apsw", name)
        self._database, self._system = connected(stream, name)
        self._topics: dict[int, Topic] = {}
        have = {row[0] for row in self._ask("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if not {"topics", "messages"} <= have:
            raise UnreadableFile(
                name, "is an SQLite database but not a ROS 2 bag: it has no tables topics and messages"
            )
        texts = self._definitions() if "message_definitions" in have else {}
        for number, topic, title, form in self._ask("SELECT id, name, type, serialization_format FROM topics"):
            self._topics[number] = self._topic(number, str(topic), str(title), str(form), texts)

    def _ask(self, query: str, values: Sequence[Any] = ()) -> Iterator[tuple[Any, ...]]:
        try:
            yield from self._database.execute(query, tuple(values))
        except self._apsw.Error as error:
            raise UnreadableFile(
                self._name, f"the database cannot be read ({str(error)[:120]}): it is damaged or cut off"
            ) from error

    def _definitions(self) -> dict[str, tuple[str, str]]:
        found = self._ask("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
        return {str(title): (str(encoding), str(text)) for title, encoding, text in found}

    def _topic(self, number: int, topic: str, title: str, form: str, texts: dict[str, tuple[str, str]]) -> Topic:
        found = Topic(topic, full_name(title), None, cdr=True)
        if form != "cdr":
            found.problem = f"messages of the form {quoted(form)} are not read, only cdr"
            return found
        encoding, text = texts.get(title, ("", ""))
        known = parsed(text, title, encoding, self._name) if text else None
        found.types = known if known is not None else distribution(self._name)
        if found.type_name not in found.types:
            found.problem = f"the bag has no definition of {quoted(title)}, and it is none of the common types"
        first = next(self._ask("SELECT data FROM messages WHERE topic_id = ? LIMIT 1", [number]), None)
        found.first = None if first is None else self._plain(first[0])
        count = next(self._ask("SELECT count(*) FROM messages WHERE topic_id = ?", [number]))
        found.rows = int(count[0])
        return found

    def _plain(self, data: bytes) -> bytes:
        """Return a message, unpacked where the bag was recorded with compression_mode message."""
        return unpacked_stream(data, self._name) if data[:4] == ZSTD else bytes(data)

    def tables(self) -> list[LogTable]:
        """Return the topics that have messages as tables."""
        return [topic.table() for topic in self._topics.values() if topic.rows]

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of a topic's messages in the order of arrival: for each named column its values, (n,). Raises
        `UnreadableFile`.
        """
        number = next((n for n, topic in self._topics.items() if topic.name == table.name), None)
        if number is None:
            return
        batches = Batches(Decoder(self._topics[number], columns, self._name))
        query = "SELECT timestamp, data FROM messages WHERE topic_id = ? ORDER BY id"
        for received, data in self._ask(query, [number]):
            yield from batches.add(self._plain(data), received)
        yield from batches.rest()
