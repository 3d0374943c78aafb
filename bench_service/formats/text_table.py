"""Head of a delimited text: the beginning of its table, its column names, the width of its lines.

The width of most lines is the law; a first line that differs is blamed itself.
"""

import csv
import difflib
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from typing import BinaryIO

from bench_service.formats.bounds import COLUMNS, LINE_BYTES, Bounds, listed, not_one_column, quoted
from bench_service.formats.description import DELIMITERS, Column, ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.text_source import TextSource, text_of, too_long

SAMPLE_LINES = 200
MARKERS = "#%"
"""Marks at the beginning of a comment, and of the names of columns in some files."""


class TextTable:
    """Table of a delimited text after its head: its column names, its delimiter, the width of its lines."""

    def __init__(self, stream: BinaryIO, name: str, description: ImportDescription, bounds: Bounds) -> None:
        self.name = name
        self._named_delimiter = description.delimiter
        self._delimiter = DELIMITERS[description.delimiter]
        self.text = TextSource(stream, name, bounds.unpacked_bytes)
        self.first_line = 1
        for _ in range(description.header_lines):
            self.text.line(self.first_line)
            self.first_line += 1
        self.names: list[str] | None = None
        self._find_table(description.header)
        if self.width > COLUMNS:
            raise UnreadableFile(name, f"has {self.width} columns, at most {COLUMNS} are read")

    def cells(self, line: bytes) -> list[bytes]:
        """Return the cells of a line, quotes kept."""
        bare = line.rstrip(b"\r\n")
        if self._delimiter == b" ":
            return bare.split()
        if b'"' in bare and self._delimiter in bare:
            text = bare.decode("utf-8", errors="surrogateescape")
            with suppress(csv.Error):  # a quote without its end, say
                row = next(csv.reader([text], delimiter=self._delimiter.decode()), [])
                return [cell.encode("utf-8", errors="surrogateescape") for cell in row]
        return bare.split(self._delimiter)

    def _find_table(self, header: bool) -> None:
        """Skip comments, take the names, and learn the width. Raises `UnreadableFile`."""
        lines = self._sample()
        if not lines:
            skipped = (
                f"; header_lines = {self.first_line - 1} leaves nothing of the file" if self.first_line > 1 else ""
            )
            raise UnreadableFile(
                self.name,
                f"line {self.first_line} is empty; a table was expected there{skipped or ': the file is empty'}",
            )
        rows = [self.cells(line) for line in lines]
        if not lines[0].strip():
            more = next((k for k, line in enumerate(lines) if line.strip()), None)
            way = f": header_lines = {self.first_line - 1 + more} leaves out what is empty" if more else ""
            raise UnreadableFile(self.name, f"line {self.first_line} is empty; a table was expected there{way}")
        filled = [row for row, line in zip(rows, lines, strict=True) if line.strip()]
        plain = [row for row, line in zip(rows, lines, strict=True) if line.strip() and line[:1] not in (b"#", b"%")]
        filled = plain or filled  # a short table may have more comments than rows
        self.width = _usual_width(filled[1:] if header and len(filled) > 1 else filled, len(filled[0]))
        comments = self._comments(lines, rows, header)
        for _ in range(comments):
            self.text.line(self.first_line)
            self.first_line += 1
        if not header:
            self._require_width(rows[comments : comments + 1], len(filled) - comments)
            return
        if comments == len(rows):
            raise UnreadableFile(self.name, "has only comments; a table was expected")
        self.names = [_name(cell) for cell in self.cells(self.text.line(self.first_line))]
        self.first_line += 1
        data = [row for row in rows[comments + 1 :] if any(cell.strip() for cell in row)]
        self._match_names(data)

    def _sample(self) -> list[bytes]:
        """The first lines that are at hand, the last of them whole. Raises `UnreadableFile` for one without an end."""
        self.text.fill(LINE_BYTES)
        glance = self.text.glance()[: 4 * LINE_BYTES]
        lines = glance.split(b"\n", SAMPLE_LINES)
        for number, line in enumerate(lines, self.first_line):
            if len(line) >= LINE_BYTES and number < self.first_line + SAMPLE_LINES:
                raise too_long(self.name, number)
        if len(lines) > 1 and (not lines[-1] or not self.text.is_over or len(lines) > SAMPLE_LINES):
            lines.pop()
        return [line + b"\n" for line in lines] if any(lines) else []

    def _comments(self, lines: Sequence[bytes], rows: Sequence[list[bytes]], header: bool) -> int:
        """Count the comment lines at the beginning; the last of them may be the names."""
        count = 0
        while count < len(lines) and lines[count][:1] in (b"#", b"%"):
            count += 1
        if not header or not count:
            return count
        bare = lines[count - 1].lstrip(MARKERS.encode() + b" \t")
        names = len(self.cells(bare)) == self.width or len(rows[count - 1]) == self.width
        if names and (count == len(lines) or _is_number(_first(rows[count]))):
            return count - 1
        return count

    def _require_width(self, first: Sequence[list[bytes]], lines: int) -> None:
        """Check the first line of data. Raises `UnreadableFile` where it is narrower or wider than most lines."""
        if first and len(first[0]) != self.width and lines > 2:
            raise UnreadableFile(
                self.name,
                f"line {self.first_line} has {len(first[0])} columns, most lines have {self.width}: where it is cut "
                f"off, header_lines = {self.first_line} leaves it out",
            )

    def _match_names(self, data: Sequence[list[bytes]]) -> None:
        """Check that there are as many names as columns, but for a delimiter at the end. Raises `UnreadableFile`."""
        names = self.names or []
        if not data:
            self.width = len(names)
            return
        if len(names) == self.width - 1 and all(len(r) != self.width or not r[-1].strip() for r in data):
            names.append("")
        if len(names) == self.width + 1 and not names[-1]:
            names.pop()
        if len(names) == self.width + 1 and not names[0].strip(MARKERS):
            names.pop(0)  # the mark of a comment, apart from the names by a blank
        if len(names) == self.width:
            return
        if len(data) < 2 and len(names) > 1:  # a single line is no law
            self.width = len(names)
            return
        line = self.first_line - 1
        blanks = (
            "; names that have blanks in them are no cells of their own: header_lines and header = false, with columns "
            "by number, read it"
            if self._delimiter == b" "
            else f"; where it is cut off or no names, header_lines = {line} leaves it out"
        )
        raise UnreadableFile(
            self.name, f"line {line} has {len(names)} names, most lines have {self.width} columns{blanks}"
        )

    def indices(self, columns: Sequence[Column]) -> list[int]:
        """Return the indices of the columns, from 0. Raises `UnreadableFile` for a column that the file does not
        have.
        """
        present = listed(self.names) if self.names else "0" if self.width == 1 else f"0 … {self.width - 1}"
        found: list[int] = []
        for column in columns:
            if isinstance(column, str):
                matches = [i for i, n in enumerate(self.names or []) if _same(n, column)]
                if len(matches) != 1:
                    hint = "" if matches else self._hint(column)
                    raise UnreadableFile(self.name, not_one_column(column, len(matches), present) + hint)
                column = matches[0]
            if not 0 <= column < self.width:
                raise UnreadableFile(self.name, f"has no column {column}; the columns are {present}{self._wide()}")
            found.append(column)
        return found

    def _hint(self, column: str) -> str:
        """Guess why no column has a name."""
        if self.names is None:
            return "; without a line of names (header = false) columns are given by number, from 0"
        if wide := self._wide():
            return wide
        near = difflib.get_close_matches(column[:64], [n[:64] for n in self.names[:200]], 1, 0.6)
        if near:
            return f"; is it {quoted(near[0])}?"
        if all(_is_number(n.encode()) for n in self.names if n):
            return "; the first line looks like data: header = false takes columns by number, from 0"
        return ""

    def _wide(self) -> str:
        """Guess the delimiter where each line is one cell."""
        if self.width != 1:
            return ""
        line = self.text.glance().split(b"\n", 1)[0][:LINE_BYTES]
        counts = {
            name: len(line.split() if mark == b" " else line.split(mark))
            for name, mark in DELIMITERS.items()
            if name != self._named_delimiter
        }
        best = max(counts, key=lambda name: counts[name])
        if counts[best] < 2:
            return ""
        return f"; with the delimiter {best!r} there would be {counts[best]} columns: give delimiter = {best!r}"


def _usual_width(rows: Sequence[list[bytes]], preferred: int) -> int:
    """The number of cells that most lines have; of several, the preferred one, or that of the later line."""
    counts = Counter(len(row) for row in rows)
    most = max(counts.values())
    if counts[preferred] == most:
        return preferred
    return next(len(row) for row in reversed(rows) if counts[len(row)] == most)


def _name(cell: bytes) -> str:
    return text_of(cell).strip().strip('"').strip()


def _same(name: str, wanted: str) -> bool:
    """Return whether a column has the requested name: # and % before the first of the names do not belong to it."""
    return name == wanted or name.lstrip(MARKERS + " \t") == wanted.strip().lstrip(MARKERS + " \t") != ""


def _first(row: Sequence[bytes]) -> bytes:
    return row[0] if row else b""


def _is_number(cell: bytes) -> bool:
    try:
        float(cell.strip().strip(b'"').replace(b",", b"."))
    except ValueError:
        return False
    return True
