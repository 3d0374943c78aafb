"""Tables out of files that hold arrays by name: arrays of one length belong together."""

from collections.abc import Sequence
from dataclasses import dataclass

from bench_service.formats.logs.names import Hint, hint, is_time, unit_of
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable

MOST_ARRAYS = 4096
WIDEST = 64
"""Most columns of a matrix; a wider one is no series of samples."""


@dataclass(frozen=True)
class NamedArray:
    """An array of a file: `rows` samples of `width` columns. `unit`: text of the unit, where the file has one."""

    name: str
    rows: int
    width: int
    unit: str = ""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of its columns: its own, or name[0], name[1], …."""
        return (self.name,) if self.width == 1 else tuple(f"{self.name}[{i}]" for i in range(self.width))


def tables_by_length(arrays: Sequence[NamedArray], notes: Sequence[str] = ()) -> list[LogTable]:
    """Return one table for each length that arrays have, the longest first; single numbers are no samples."""
    lengths: dict[int, list[NamedArray]] = {}
    for array in arrays:
        if array.rows > 1 and 1 <= array.width <= WIDEST:
            lengths.setdefault(array.rows, []).append(array)
    return [_table(rows, lengths[rows], tuple(notes)) for rows in sorted(lengths, reverse=True)]


def _table(rows: int, arrays: Sequence[NamedArray], notes: tuple[str, ...]) -> LogTable:
    columns: list[LogColumn] = []
    clocks: list[LogClock] = []
    for array in arrays:
        guesses = [hint(name) for name in array.columns]
        for name, guess in zip(array.columns, guesses, strict=True):
            columns.append(_column(name, array, guess))
        if array.width == 1 and is_time(array.name) and guesses[0].quantity is None:
            clocks.append(LogClock(array.name, None, f"array {array.name!r}"))
    return LogTable(f"{rows} rows", tuple(columns), tuple(clocks), None, rows, notes)


def _column(name: str, array: NamedArray, guess: Hint) -> LogColumn:
    if guess.quantity is None:
        return LogColumn(name)
    said = unit_of(array.unit, guess.quantity) if array.unit else None
    source = f"the array's own unit, {array.unit}" if said else "the name of the array"
    return LogColumn(name, guess.quantity, said or guess.unit, channel=guess.channel, source=source, doubt=guess.doubt)
