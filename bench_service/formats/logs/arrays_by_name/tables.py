"""Tables out of files that hold arrays by name: arrays of one length belong together."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from bench_service.formats.bounds import quoted
from bench_service.formats.description import SECONDS
from bench_service.formats.logs.names import Hint, hint, is_time, time_unit, unit_of
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable

MOST_ARRAYS = 4096
WIDEST = 64
"""Most columns of a matrix; a wider one is no series of samples."""
LYING_ROWS = 16
"""Most rows of a wider matrix that is taken to hold its samples in columns."""
_RATE = re.compile(
    r"(?:^|[./])(?:imu_?)?(?:fs|odr|freq|frequency|rate|sampl(?:e|ing)[_ ]?(?:rate|freq(?:uency)?))(?:[_ ]?hz)?$",
    re.IGNORECASE,
)


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


class StatedRates:
    """Rates that a file states in single numbers or attributes: fs, freq, sampling_rate and such."""

    def __init__(self) -> None:
        self._found: dict[str, float] = {}

    def add(self, name: str, value: object) -> None:
        """Take a single number whose name is that of a rate."""
        if _RATE.search(name) is None or len(self._found) > MOST_ARRAYS:
            return
        with suppress(TypeError, ValueError):
            numbers = np.asarray(value).reshape(-1)
            number = float(numbers[0]) if numbers.size == 1 else 0.0
            if 0.0 < number < inf:
                self._found[name] = number

    def add_all(self, prefix: str, attributes: Mapping[str, object]) -> None:
        """Take the attributes that are rates."""
        for key in attributes:
            if _RATE.search(str(key)) is not None:
                self.add(f"{prefix}{key}", attributes[key])

    @property
    def rate_hz(self) -> float | None:
        """Return the one rate that is stated [Hz]; None: there is none, or there are several."""
        rates = set(self._found.values())
        return next(iter(rates)) if len(rates) == 1 else None

    @property
    def notes(self) -> tuple[str, ...]:
        """Say where rates are stated."""
        said = ", ".join(f"{quoted(name)} = {value:g}" for name, value in list(self._found.items())[:4])
        return (f"the file states a rate: {said}",) if said else ()


FACT_BYTES = 4096
"""Longest text that is taken as a fact."""


class StatedFacts:
    """Facts that a MATLAB file states in its structs `about` (of the file) and `channels` (of each variable)."""

    def __init__(self) -> None:
        self.facts: dict[str, str] = {}
        self.column_facts: dict[str, dict[str, str]] = {}

    @staticmethod
    def is_fact(title: str) -> bool:
        """Return whether a text or number of this name is a fact."""
        return title.startswith(("about.", "channels."))

    def add(self, title: str, text: str) -> None:
        """Take a text, or a number as text, by its name about.FACT or channels.VARIABLE.FACT."""
        struct, *path = title.split(".")
        if len(self.facts) + len(self.column_facts) > MOST_ARRAYS:
            return
        if struct == "about" and len(path) == 1:
            self.facts[path[0]] = text
        elif struct == "channels" and len(path) == 2:
            self.column_facts.setdefault(path[0], {})[path[1]] = text


def lies(rows: int, width: int) -> bool:
    """Return whether a matrix holds its samples in columns: a few rows, and more columns than samples ever have."""
    return 1 < rows <= LYING_ROWS and width > WIDEST


def tables_by_length(
    arrays: Sequence[NamedArray], notes: Sequence[str] = (), rates: StatedRates | None = None
) -> list[LogTable]:
    """Return one table for each length that arrays have, the longest first; single numbers are no samples."""
    lengths: dict[int, list[NamedArray]] = {}
    for array in arrays:
        if array.rows > 1 and 1 <= array.width <= WIDEST:
            lengths.setdefault(array.rows, []).append(array)
    rates = rates or StatedRates()
    said = (*notes, *rates.notes)
    return [_table(rows, lengths[rows], said, rates.rate_hz) for rows in sorted(lengths, reverse=True)]


def _table(rows: int, arrays: Sequence[NamedArray], notes: tuple[str, ...], rate_hz: float | None) -> LogTable:
    columns: list[LogColumn] = []
    clocks: list[LogClock] = []
    for array in arrays:
        guesses = [hint(name) for name in array.columns]
        for name, guess in zip(array.columns, guesses, strict=True):
            columns.append(_column(name, array, guess))
        if array.width == 1 and is_time(array.name) and guesses[0].quantity is None:
            unit = time_unit(f"[{array.unit}]") if array.unit else None
            clocks.append(LogClock(array.name, SECONDS[unit] if unit else None, f"array {array.name!r}"))
    return LogTable(f"{rows} rows", tuple(columns), tuple(clocks), rate_hz, rows, notes)


def _column(name: str, array: NamedArray, guess: Hint) -> LogColumn:
    if guess.quantity is None:
        return LogColumn(name)
    return with_unit(LogColumn(name, guess.quantity, guess.unit, channel=guess.channel, doubt=guess.doubt), array.unit)


def with_unit(column: LogColumn, said: str, of: str = "array") -> LogColumn:
    """Give a column the unit that the file says; one that its quantity does not have makes it counts, and a doubt."""
    unit = unit_of(said, column.quantity) if said.strip() else None
    if unit is not None:
        return replace(column, unit=unit, source=f"the {of}'s own unit, {quoted(said)}")
    if not said.strip():
        return replace(column, source=f"the name of the {of}")
    doubt = f"the unit that the file says, {quoted(said)}, is none of its quantity: give unit and scale"
    return replace(column, unit="count", source=f"the name of the {of}", doubt=column.doubt or doubt)
