"""Reader of zip archives of texts: a drive of KITTI, and what phone apps export (a table for each file in it)."""

import re
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, BinaryIO, cast

import numpy as np
import pyarrow as pa

from bench_service.formats.bounds import MEGABYTE, Bounds
from bench_service.formats.clock_text import NoClock, nanoseconds
from bench_service.formats.delimited import text_columns
from bench_service.formats.description import SECONDS, ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.dialects import CLOCK, in_dialect, is_clock_text
from bench_service.formats.logs.oxts import OXTS, SOURCE
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable, Numbers, triad
from bench_service.formats.text_look import TextLook, look
from procedures.core.recording import Quantity

NAME = "zip"
TITLE = "zip of texts (KITTI drives, phone apps)"
MAGIC = b"PK\x03\x04"
MOST_FILES = 400_000
_TEXTS = (".csv", ".txt", ".tsv")
_SAMPLE = re.compile(r"^((?:.*/)?)data/\d+\.txt$")
_AT_ONCE = 8192
_NOT_UNPACKED = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError)
"""Errors that zipfile raises for a member that is damaged, encrypted or packed by a method that it does not know."""


def begins(start: bytes) -> bool:
    """Return whether a file that begins so is a zip archive."""
    return start.startswith(MAGIC)


def opened(stream: BinaryIO, name: str) -> "Zipped":
    """Return a reader of a zip archive of texts. Raises `UnreadableFile`."""
    return Zipped(stream, name)


@dataclass(frozen=True)
class _Drive:
    """Files of a drive, a sample each, and the file of their stamps."""

    samples: list[str]
    stamps: str | None


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
        self._drives = self._found_drives(set(names))
        self._looks: dict[str, TextLook] = {}
        for member in sorted(n for n in names if n.lower().endswith(_TEXTS))[:100] if not self._drives else ():
            try:
                with self._open(member) as text:
                    self._looks[member] = look(text, f"{name}: {member}")
            except UnreadableFile:
                continue
        if not self._drives and not self._looks:
            raise UnreadableFile(
                name,
                "is a zip archive or a workbook without a table of text in it: unpack it, or save the sheet as CSV",
            )

    @property
    def members(self) -> tuple[str, ...]:
        """Names of the texts in the archive that are tables."""
        return tuple(self._looks)

    def _found_drives(self, names: set[str]) -> dict[str, "_Drive"]:
        """Group the samples of KITTI's drives by their folder: oxts, or what was packed from inside of it."""
        folders: dict[str, list[str]] = {}
        for name in names:
            if (match := _SAMPLE.match(name)) is not None:
                folders.setdefault(match[1], []).append(name)
        found: dict[str, _Drive] = {}
        for folder, members in sorted(folders.items()):
            if folder.endswith("oxts/") or f"{folder}dataformat.txt" in names or self._is_oxts(members[0]):
                stamps = f"{folder}timestamps.txt"
                found[folder] = _Drive(sorted(members), stamps if stamps in names else None)
        return dict(zip(("oxts",), found.values(), strict=True)) if len(found) == 1 else found

    def _is_oxts(self, member: str) -> bool:
        try:
            return len(self._values(member)) == len(OXTS)
        except (UnreadableFile, *_NOT_UNPACKED):
            return False

    def _open(self, member: str) -> BinaryIO:
        return cast(BinaryIO, self._archive.open(member))

    def tables(self) -> list[LogTable]:
        """Return each drive as one table, or each text as one."""
        if self._drives:
            return [_drive_table(name, drive) for name, drive in self._drives.items()]
        return [_text_table(member, found) for member, found in self._looks.items()]

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of the rows of a drive, or of a text: for each named column its values, (n,). Raises
        `UnreadableFile`.
        """
        try:
            drive = self._drives.get(table.name)
            yield from self._text_rows(table, columns) if drive is None else self._drive_rows(drive, columns)
        except _NOT_UNPACKED as error:
            raise UnreadableFile(self._name, f"a file in the archive cannot be unpacked ({error})") from error

    def _drive_rows(self, drive: "_Drive", columns: Sequence[str]) -> Iterator[list[Numbers]]:
        stamps = self._stamp_texts(drive.stamps) if drive.stamps else []
        if drive.stamps and len(stamps) < len(drive.samples):
            raise UnreadableFile(
                self._name, f"{drive.stamps} has {len(stamps)} stamps for {len(drive.samples)} files of oxts/data"
            )
        for start in range(0, len(drive.samples), _AT_ONCE):
            members = drive.samples[start : start + _AT_ONCE]
            data = np.array([self._values(member) for member in members])
            found: list[Numbers] = []
            for name in columns:
                if name == "timestamp":
                    found.append(self._times(stamps[start : start + len(members)], start, drive.stamps or ""))
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

    def _stamp_texts(self, member: str) -> list[str]:
        info = self._archive.getinfo(member)
        if info.file_size > 64 * MEGABYTE:
            raise UnreadableFile(self._name, f"{member} has {info.file_size} bytes: it is not a list of time stamps")
        return self._archive.read(info).decode("ascii", "replace").split("\n")

    def _times(self, texts: Sequence[str], row: int, member: str) -> Numbers:
        try:
            return nanoseconds(pa.array([text.strip() for text in texts]), "decimal")
        except NoClock as error:
            raise UnreadableFile(
                self._name, f"{member}: line {row + error.row + 1} is not a time: {error.text[:40]!r}"
            ) from error

    def _text_rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        found = self._looks[table.name]
        time = next((name for name in columns if table.clock(name) is not None), None)
        values = [name for name in columns if name != time]
        description = _described(found, time, values)
        asked = [_column(found, name) for name in ([time] if time is not None else []) + values]
        with self._open(table.name) as text:
            for block in text_columns(text, f"{self._name}: {table.name}", asked, description, Bounds()):
                taken: dict[str, Numbers] = {name: block.values[:, place] for place, name in enumerate(values)}
                if time is not None and block.stamps is not None:
                    taken[time] = block.stamps
                yield [taken[name] for name in columns]


def _described(found: TextLook, time: str | None, values: Sequence[str]) -> ImportDescription:
    """Describe columns so that the reader of texts gives their raw values."""
    channels: list[dict[str, Any]] = [
        {"name": f"c{place}", "column": _column(found, name or ""), "quantity": "angular_rate", "unit": "count"}
        for place, name in enumerate(values or [time])
    ]
    return ImportDescription.model_validate(
        {
            "unit": "U",
            "channels": channels,
            "rate_hz": 1.0,
            "time_column": None if time is None else _column(found, time),
            "time_unit": CLOCK if time is not None and is_clock_text(found, time) else "s",
            "header": _has_names(found),
            "delimiter": found.delimiter,
            "decimal": found.decimal,
            "header_lines": found.header_lines,
            "gaps": "mark",
        }
    )


def _has_names(found: TextLook) -> bool:
    return found.names is not None and found.units is None


def _column(found: TextLook, name: str) -> str | int:
    """Return how the reader of texts is asked for a column: by number where the text has no names right above it."""
    return name if _has_names(found) else int(name)


def _drive_table(name: str, drive: _Drive) -> LogTable:
    columns = {c.name: c for c in triad(("wx", "wy", "wz"), "gyro", Quantity.ANGULAR_RATE, "rad/s", source=SOURCE)}
    columns |= {
        c.name: c for c in triad(("ax", "ay", "az"), "accelerometer", Quantity.SPECIFIC_FORCE, "m/s^2", source=SOURCE)
    }
    clocks = (LogClock("timestamp", 1e-9, "oxts/timestamps.txt: the recorder's clock"),) if drive.stamps else ()
    notes = (
        "the drives «sync» hold the samples at the cameras' 10 Hz, the drives «extract» those at 100 Hz; values "
        "are those of the navigator OXTS RT3003, corrected by it",
    )
    every = tuple(columns.get(column, LogColumn(column)) for column in OXTS)
    return LogTable(name, every, clocks, None, len(drive.samples), notes)


def _text_table(member: str, found: TextLook) -> LogTable:
    """Understand a text of the archive by its dialect, its clocks with their units."""
    text = in_dialect(found, member)
    clocks = tuple(replace(c, unit_s=c.unit_s or _unit_s(text.time_units.get(c.column, ""))) for c in text.table.clocks)
    notes = ("one table for each file of the archive", *text.table.notes)
    title = () if text.format == "text" else (f"{member} is taken as {text.title}",)
    return replace(text.table, name=member, clocks=clocks, notes=(*notes, *title))


def _unit_s(unit: str) -> float | None:
    return 1e-9 if unit == CLOCK else SECONDS.get(unit)
