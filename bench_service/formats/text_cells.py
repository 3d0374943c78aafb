"""Diagnosis of the first wrong line in a piece of text, with the reason and the way out."""

import math
import re
from collections.abc import Sequence

from bench_service.formats.bounds import LINE_BYTES, quoted
from bench_service.formats.clock_text import LOOKS_LIKE_CLOCK
from bench_service.formats.description import Column, ImportDescription
from bench_service.formats.text_source import too_long
from bench_service.formats.text_table import TextTable

_COMMA = re.compile(r"^[+-]?\d*,\d+([eE][+-]?\d+)?$")
_THOUSANDS = re.compile(r"^[+-]?\d{1,3}([,.' ]\d{3}){2,}")
_WITH_TEXT = re.compile(r"^([+-]?\d+(?:\.\d+)?)\s*[A-Za-zµ°%].*$")
_HEXADECIMAL = re.compile(r"^0[xX][0-9a-fA-F]+$")
_MISSING = ("", "nan", "na", "n/a", "null", "none", "-", "--")


def first_fault(
    table: TextTable,
    text: bytes,
    first_line: int,
    columns: Sequence[Column],
    indices: Sequence[int],
    description: ImportDescription,
) -> str | None:
    """Return the fault in the first bad line of a piece as a sentence; `first_line` numbers its first line; None: none
    is found. Raises `UnreadableFile` for a line without an end.
    """
    for number, line in enumerate(text.splitlines(keepends=True), first_line):
        if len(line) > LINE_BYTES:
            raise too_long(table.name, number)
        if not line.strip():
            continue
        cells = table.cells(line)
        if len(cells) != table.width:
            return _width(number, line, len(cells), table.width, description)
        for place, (column, index) in enumerate(zip(columns, indices, strict=True)):
            cell = cells[index].decode(errors="replace").strip().strip('"').strip()
            is_time = place == 0 and description.time_column is not None
            problem = _cell(cell, table.names[index] if table.names else "", is_time, description)
            if problem is not None:
                shown = quoted(column) if isinstance(column, str) else repr(column)
                return f"line {number}, column {shown}: {quoted(cell)} {problem}"
    return None


def _width(number: int, line: bytes, cells: int, width: int, description: ImportDescription) -> str:
    cut = "" if line.endswith(b"\n") else "; the file seems to be cut off"
    twice = description.delimiter == "," and cells > width and cells % 2 == 0
    comma = "; a decimal comma cannot be distinguished from the delimiter ','" if twice and b'"' not in line else ""
    way = "; rows gives a range without it" if not comma else ""
    return f"line {number} has {cells} columns, {width} were expected{cut}{comma}{way}"


def _cell(cell: str, name: str, is_time: bool, description: ImportDescription) -> str | None:
    """Describe why a cell is no number, or no time; None: it is one."""
    if is_time and description.time_unit == "clock":
        if LOOKS_LIKE_CLOCK.match(cell):
            return None
        return "where the text of a clock was expected: for numbers give time_unit s, ms, us or ns"
    number = _number(cell, description.decimal)
    if number is not None and math.isfinite(number):
        return None
    missing = cell.lower() in _MISSING
    if missing and description.gaps == "mark" and not is_time and cell.lower() in ("", "nan"):
        return None
    expected = "where a finite number was expected"
    hint = _hint(cell, name, is_time, missing, description)
    return f"{expected}: {hint}" if hint else expected


def _hint(cell: str, name: str, is_time: bool, missing: bool, description: ImportDescription) -> str:
    if missing:
        return "" if is_time else 'gaps = "mark" takes an empty or NaN cell as a gap'
    if description.decimal == "." and _COMMA.match(cell):
        return 'a decimal comma: decimal = "," reads it'
    if description.decimal == "," and _number(cell, ".") is not None:
        return 'a decimal point: decimal = "." reads it'
    if LOOKS_LIKE_CLOCK.match(cell):
        return 'text of a clock: time_unit = "clock" reads it, or leave time_column out and give rate_hz'
    if name and cell == name:
        return "the names once more: files that were put together are joined without them"
    if _HEXADECIMAL.match(cell):
        return "hexadecimal numbers are not read"
    if _THOUSANDS.match(cell):
        return "a mark between thousands is not read"
    if _WITH_TEXT.match(cell):
        return "numbers with their unit or other text behind them are not read"
    return ""


def _number(cell: str, decimal: str) -> float | None:
    if decimal == "," and "." in cell:
        return None
    try:
        return float(cell.replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return None
