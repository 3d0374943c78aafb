"""Recognition of a delimited text by its beginning: its delimiter, the line of names, the decimal mark."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import BinaryIO

from bench_service.formats.bounds import LINE_BYTES, Bounds
from bench_service.formats.description import DELIMITERS
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.input_units import every_unit, spelled
from bench_service.formats.text_source import TextSource, text_of

LOOKED_AT = 300
"""Number of lines from which a table is recognised."""
_CLOCK = re.compile(rb"^\d{1,4}[-/:]\d\d?[-/:]\d\d.*$")
_UNITS = {*every_unit(), "s", "sec", "ms", "us", "µs", "ns", "rad/sec", "deg/sec", "degree/s", "degc", "m/s/s", "-"}
"""Cells of a line of units below the names."""
_MISSING = (b"", b"nan", b"na", b"null", b"none")


@dataclass(frozen=True)
class TextLook:
    """Form of a delimited text by its beginning: delimiter, decimal mark, lines before the data, names, width."""

    delimiter: str
    decimal: str
    header_lines: int
    """Lines before the names, or before the data where there are no names."""
    names: tuple[str, ...] | None
    """Names of the columns; None: the text has none."""
    units: tuple[str, ...] | None
    """Units of the columns where they have a line of their own below the names, which `header_lines` counts too."""
    width: int
    preamble: tuple[str, ...]
    """The lines before the table."""
    first: tuple[str, ...]
    """Cells of the first row of data."""


def look(stream: BinaryIO, name: str) -> TextLook:
    """Return the form of the table in a text, by its beginning. Raises `UnreadableFile` where there is none."""
    source = TextSource(stream, name, Bounds().unpacked_bytes)
    source.fill(LINE_BYTES)
    lines = source.glance().split(b"\n")[: LOOKED_AT + 1]
    lines = [line.rstrip(b"\r") for line in (lines[:-1] if len(lines) > 1 else lines)]
    best: tuple[int, int, str, str] | None = None
    for delimiter in DELIMITERS:
        for decimal in (".", ","):
            if decimal == "," and delimiter == ",":
                continue
            rows, begin = _longest(lines, delimiter, decimal)
            width = len(_cells(lines[begin], delimiter)) if rows else 0
            if rows and width > 1 and (best is None or (rows, width) > (best[0], best[1])):
                best = (rows, width, delimiter, decimal)
    if best is None:
        raise UnreadableFile(name, "no table of numbers is recognised at its beginning: give a description by hand")
    rows, width, delimiter, decimal = best
    _, begin = _longest(lines, delimiter, decimal)
    names_at = _names_at(lines, begin, delimiter, width)
    head = begin if names_at is None else names_at
    names = None if names_at is None else _wide(_named(lines[names_at], delimiter), width)
    units = None
    if names is not None and names_at is not None and _are_units(names):
        above = _names_at(lines, names_at, delimiter, width)
        if above is not None:
            units, names, head = _bare_units(names), _wide(_named(lines[above], delimiter), width), names_at + 1
    return TextLook(
        delimiter,
        decimal,
        head,
        names,
        units,
        width,
        tuple(text_of(line) for line in lines[:head]),
        tuple(text_of(cell).strip() for cell in _cells(lines[begin], delimiter)),
    )


def _wide(names: list[str], width: int) -> tuple[str, ...]:
    """Give a line of names the width of its table: the last name may be missing, where lines end with a delimiter."""
    return tuple([*names, *[""] * width][:width])


def _are_units(cells: Sequence[str]) -> bool:
    """Return whether a line above the data holds units, not names: most of its cells are units."""
    filled = [cell for cell in _bare_units(cells) if cell.strip("-")]
    known = sum(cell.lower() in _UNITS or spelled(cell) in _UNITS for cell in filled)
    return known > 1 and known > 0.6 * len(filled)


def _bare_units(cells: Sequence[str]) -> tuple[str, ...]:
    """Take units out of their brackets."""
    return tuple(cell.strip("[](){} ") for cell in cells)


def _longest(lines: list[bytes], delimiter: str, decimal: str) -> tuple[int, int]:
    """Count the longest run of rows of one width in which most cells are numbers, and where it begins."""
    best, begin, run, start, width = 0, 0, 0, 0, 0
    for number, line in enumerate(lines):
        cells = _cells(line, delimiter)
        if _is_data(cells, decimal) and (not run or len(cells) == width):
            start = start if run else number
            run, width = run + 1, len(cells)
            if run > best:
                best, begin = run, start
        elif line.strip():
            run = 0
            if _is_data(cells, decimal):
                run, start, width = 1, number, len(cells)
    return best, begin


def _is_data(cells: list[bytes], decimal: str) -> bool:
    if not cells or cells[0][:1] in (b"#", b"%", b"/"):
        return False
    numbers = sum(_is_number(cell, decimal) for cell in cells)
    return (
        numbers > 0 and numbers >= 0.5 * len(cells) and (_is_number(cells[0], decimal) or bool(_CLOCK.match(cells[0])))
    )


def _is_number(cell: bytes, decimal: str) -> bool:
    bare = cell.strip().strip(b'"').strip()
    if bare.lower() in _MISSING:
        return bare != b""
    if decimal == ",":
        if b"." in bare:
            return False
        bare = bare.replace(b",", b".")
    try:
        float(bare)
    except ValueError:
        return False
    return True


def _cells(line: bytes, delimiter: str) -> list[bytes]:
    return line.split() if delimiter == "whitespace" else line.split(DELIMITERS[delimiter])


def _named(line: bytes, delimiter: str) -> list[str]:
    bare = text_of(line).lstrip("#% \t") if line[:1] in (b"#", b"%") else text_of(line)
    cells = bare.split() if delimiter == "whitespace" else bare.split(DELIMITERS[delimiter].decode())
    return [cell.strip().strip('"').strip() for cell in cells]


def _names_at(lines: list[bytes], begin: int, delimiter: str, width: int) -> int | None:
    """Find the line of names right before the data; blank lines may lie between."""
    at = begin - 1
    while at >= 0 and not lines[at].strip():
        at -= 1
    if at < 0:
        return None
    names = _named(lines[at], delimiter)
    while names and not names[-1]:
        names.pop()
    words = sum(not _is_number(name.encode(), ".") for name in names)
    return at if len(names) in (width, width - 1) and words > 0.5 * len(names) else None
