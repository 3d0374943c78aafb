"""Limits on the resources that a file may demand: lines, columns, numbers, unpacked bytes, memory and time.

Compressed formats give a small file room to ask for a thousand times its size, so every bound is checked before the
bytes are made. Must not know formats or processes.
"""

from dataclasses import dataclass

MEGABYTE = 1_000_000
LINE_BYTES = 256 * 1024
"""Longest line of a text file: 64 channels of 25 characters are 1.6 kB."""
COLUMNS = 4096
"""Most columns of a table, of which 65 can be read at once."""
SHOWN_NAMES = 12
"""Number of column names that a message lists at most."""
SHOWN_CHARACTERS = 80
"""Number of characters of a cell or a name that a message quotes at most."""


@dataclass(frozen=True)
class Bounds:
    """Limits of cells, bytes, memory and time of one import; they grow with the size of the files beyond 100 MB."""

    cells: int = 100_000_000
    """Largest number of cells that are read: six channels at 400 Hz for 11 h."""
    unpacked_bytes: int = 4_000 * MEGABYTE
    """Largest size of a text after unpacking, or of the columns of a columnar file [bytes]."""
    memory_bytes: int = 250 * MEGABYTE
    """Memory of the process that reads, above what it takes idle [bytes]."""
    time_s: float = 25.0
    """Time for which the reading process may be waited for [s]."""

    @classmethod
    def of(cls, file_bytes: int) -> "Bounds":
        """Return the bounds of files with this total size [bytes]."""
        hundreds = max(1.0, file_bytes / (100 * MEGABYTE))
        return cls(
            cells=int(cls.cells * hundreds),
            unpacked_bytes=int(cls.unpacked_bytes * hundreds),
            memory_bytes=int(cls.memory_bytes + MEGABYTE * 100 * (hundreds - 1.0)),
            time_s=cls.time_s * hundreds,
        )


def quoted(text: str) -> str:
    """Return a cell or a name in quotes for a message, shortened where it is long."""
    return repr(text if len(text) <= SHOWN_CHARACTERS else text[: SHOWN_CHARACTERS - 1] + "…")


def not_one_column(column: str, count: int, present: str) -> str:
    """Return the sentence that no column, or more than one, has a name; `present`: the columns that the file has, as
    `listed` lists them.
    """
    if count == 0:
        return f"has no column {quoted(column)}; the columns are {present}"
    way = f"{count} have this name: give the column by its number, from 0"
    return f"has more than one column {quoted(column)}; the columns are {present}; {way}"


def listed(names: list[str]) -> str:
    """Return column names as text for a message: the first few, and how many there are."""
    shown = ", ".join(n if len(n) <= SHOWN_CHARACTERS else n[: SHOWN_CHARACTERS - 1] + "…" for n in names[:SHOWN_NAMES])
    return shown if len(names) <= SHOWN_NAMES else f"{shown}, … ({len(names)} columns)"
