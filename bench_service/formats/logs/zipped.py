"""Reader of zip archives of texts: a drive of KITTI, and what phone apps export (a table for each file in it)."""

import re
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO, cast

import numpy as np
import pyarrow as pa

from bench_service.formats.bounds import MEGABYTE, Bounds
from bench_service.formats.clock_text import NoClock, nanoseconds
from bench_service.formats.delimited import text_columns
from bench_service.formats.description import SECONDS, ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.names import hint, is_time, time_unit
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable, Numbers, triad
from bench_service.formats.text_look import TextLook, look
from procedures.core.recording import Quantity

NAME = "zip"
TITLE = "zip of texts (KITTI drives, phone apps)"
MAGIC = b"PK\x03\x04"
MOST_FILES = 400_000
_TEXTS = (".csv", ".txt", ".tsv")
_OXTS = re.compile(r"(?:^|/)oxts/data/\d+\.txt$")
_STAMPS = re.compile(r"(?:^|/)oxts/timestamps\.txt$")
OXTS = (
    "lat",
    "lon",
    "alt",
    "roll",
    "pitch",
    "yaw",
    "vn",
    "ve",
    "vf",
    "vl",
    "vu",
    "ax",
    "ay",
    "az",
    "af",
    "al",
    "au",
    "wx",
    "wy",
    "wz",
    "wf",
    "wl",
    "wu",
    "pos_accuracy",
    "vel_accuracy",
    "navstat",
    "numsats",
    "posmode",
    "velmode",
    "orimode",
)
_AT_ONCE = 8192
_KITTI = "dataformat.txt of KITTI's raw data: the vehicle's x (forward), y (left), z (up)"


def begins(start: bytes) -> bool:
    """Return whether a file that begins so is a zip archive."""
    return start.startswith(MAGIC)


def opened(stream: BinaryIO, name: str) -> "Zipped":
    """Return a reader of a zip archive of texts. Raises `UnreadableFile`."""
    return Zipped(stream, name)


class Zipped:
    """Reader of one zip archive of texts: a KITTI drive, or a table for each text. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._name = name
        self.warnings: list[str] = []
        try:
            self._archive = zipfile.ZipFile(stream)
        except (zipfile.BadZipFile, OSError, ValueError) as error:
            raise UnreadableFile(name, f"is a zip archive that is damaged or cut off ({error})") from error
        names = [info.filename for info in self._archive.infolist() if not info.is_dir()]
        if len(names) > MOST_FILES:
            raise UnreadableFile(name, f"holds {len(names)} files, at most {MOST_FILES} are read")
        self._oxts = sorted(n for n in names if _OXTS.search(n))
        self._stamps = next((n for n in names if _STAMPS.search(n)), None)
        self._looks: dict[str, TextLook] = {}
        for member in sorted(n for n in names if n.lower().endswith(_TEXTS))[:100] if not self._oxts else ():
            try:
                with self._open(member) as text:
                    self._looks[member] = look(text, f"{name}: {member}")
            except UnreadableFile:
                continue
        if not self._oxts and not self._looks:
            raise UnreadableFile(
                name,
                "is a zip archive or a workbook without a table of text in it: unpack it, or save the sheet as CSV",
            )

    def _open(self, member: str) -> BinaryIO:
        return cast(BinaryIO, self._archive.open(member))

    def tables(self) -> list[LogTable]:
        """Return the drive as one table, or each text as one."""
        if self._oxts:
            return [self._drive()]
        return [_text_table(member, found) for member, found in self._looks.items()]

    def _drive(self) -> LogTable:
        columns = {c.name: c for c in triad(("wx", "wy", "wz"), "gyro", Quantity.ANGULAR_RATE, "rad/s", source=_KITTI)}
        columns |= {
            c.name: c
            for c in triad(("ax", "ay", "az"), "accelerometer", Quantity.SPECIFIC_FORCE, "m/s^2", source=_KITTI)
        }
        clocks = (LogClock("timestamp", 1e-9, "oxts/timestamps.txt: the recorder's clock"),) if self._stamps else ()
        notes = (
            "the drives «sync» hold the samples at the cameras' 10 Hz, the drives «extract» those at 100 Hz; values "
            "are those of the navigator OXTS RT3003, corrected by it",
        )
        every = tuple(columns.get(name, LogColumn(name)) for name in OXTS)
        return LogTable("oxts", every, clocks, None, len(self._oxts), notes)

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of the rows of a drive, or of a text: for each named column its values, (n,). Raises
        `UnreadableFile`.
        """
        try:
            yield from self._drive_rows(columns) if self._oxts else self._text_rows(table, columns)
        except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
            raise UnreadableFile(self._name, f"a file in the archive cannot be unpacked ({error})") from error

    def _drive_rows(self, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        stamps = self._stamp_texts() if self._stamps else []
        if self._stamps and len(stamps) < len(self._oxts):
            raise UnreadableFile(
                self._name, f"{self._stamps} has {len(stamps)} stamps for {len(self._oxts)} files of oxts/data"
            )
        for start in range(0, len(self._oxts), _AT_ONCE):
            members = self._oxts[start : start + _AT_ONCE]
            data = np.array([self._values(member) for member in members])
            found: list[Numbers] = []
            for name in columns:
                if name == "timestamp":
                    found.append(self._times(stamps[start : start + len(members)], start))
                else:
                    found.append(np.ascontiguousarray(data[:, OXTS.index(name)]))
            yield found

    def _values(self, member: str) -> list[float]:
        text = self._archive.read(member) if self._archive.getinfo(member).file_size < MEGABYTE else b""
        try:
            values = [float(cell) for cell in text.split()]
        except ValueError:
            values = []
        if len(values) != len(OXTS):
            raise UnreadableFile(self._name, f"{member} has not the {len(OXTS)} numbers of an OXTS sample")
        return values

    def _stamp_texts(self) -> list[str]:
        info = self._archive.getinfo(self._stamps or "")
        if info.file_size > 64 * MEGABYTE:
            raise UnreadableFile(
                self._name, f"{self._stamps} has {info.file_size} bytes: it is not a list of time stamps"
            )
        return self._archive.read(info).decode("ascii", "replace").split("\n")

    def _times(self, texts: Sequence[str], row: int) -> Numbers:
        try:
            return nanoseconds(pa.array([text.strip() for text in texts]), "decimal")
        except NoClock as error:
            raise UnreadableFile(
                self._name, f"{self._stamps}: line {row + error.row + 1} is not a time: {error.text[:40]!r}"
            ) from error

    def _text_rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        found = self._looks[table.name]
        time = next((name for name in columns if table.clock(name) is not None), None)
        values = [name for name in columns if name != time]
        description = _described(found, time, values)
        asked = ([time] if time is not None else []) + values
        with self._open(table.name) as text:
            for block in text_columns(text, f"{self._name}: {table.name}", asked, description, Bounds()):
                taken: dict[str, Numbers] = {name: block.values[:, place] for place, name in enumerate(values)}
                if time is not None and block.stamps is not None:
                    taken[time] = block.stamps
                yield [taken[name] for name in columns]


def _described(found: TextLook, time: str | None, values: Sequence[str]) -> ImportDescription:
    """Describe columns so that the reader of texts gives their raw values."""
    channels: list[dict[str, Any]] = [
        {"name": f"c{place}", "column": name, "quantity": "angular_rate", "unit": "count"}
        for place, name in enumerate(values or [time])
    ]
    return ImportDescription.model_validate(
        {
            "unit": "U",
            "channels": channels,
            "rate_hz": 1.0,
            "time_column": time,
            "delimiter": found.delimiter,
            "decimal": found.decimal,
            "header_lines": found.header_lines,
            "gaps": "mark",
        }
    )


def _text_table(member: str, found: TextLook) -> LogTable:
    names = found.names or ()
    columns: list[LogColumn] = []
    clocks: list[LogClock] = []
    where = member.rpartition("/")[2].rpartition(".")[0]
    for name in names:
        guess = hint(name)
        if guess.quantity is None and name.lower() in ("x", "y", "z"):
            guess = hint(f"{where}_{name}")
        columns.append(
            LogColumn(
                name,
                guess.quantity,
                guess.unit,
                channel=guess.channel,
                source="the names of file and column",
                doubt=guess.doubt,
            )
        )
        if is_time(name):
            unit = time_unit(name) or ("ns" if name == "time" and "seconds_elapsed" in names else None)
            clocks.append(LogClock(name, SECONDS[unit] if unit else None, f"column {name!r}"))
    return LogTable(member, tuple(columns), tuple(clocks), None, None, ("one table for each file of the archive",))
