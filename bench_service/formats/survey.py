"""First pass over imported files: finds rate, count and gaps, and refuses faults, before the first sample is stored."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench_service.formats.blocks import Block
from bench_service.formats.bounds import Bounds
from bench_service.formats.clock.column import ClockColumn
from bench_service.formats.clock.judgement import ClockFindings, judge
from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.rebuild import Increments
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording

_INT32 = np.iinfo(np.int32)


@dataclass(frozen=True)
class Findings:
    """Findings of the first pass over all files: rate, count, type of samples, clock, warnings."""

    rate_hz: float
    count: int
    """Number of rows of the recording, with those inserted for gaps, without those left out."""
    dtype: type[np.int32] | type[np.float64]
    """Integers where all values are integers."""
    clock: ClockFindings | None
    """Findings about the time column; None: there is none."""
    warnings: tuple[str, ...]


class Survey:
    """First pass over imported files: checks rows of all files as they are read."""

    def __init__(self, names: Sequence[str], description: ImportDescription, bounds: Bounds) -> None:
        self._names = names
        self._description = description
        self._bounds = bounds
        self._increments = Increments(description.channels)
        self._clock: ClockColumn | None = None
        self._last: Array | None = None
        self._count = 0
        self._integral = True
        self._missing = 0
        self._outside: str | None = None

    def close(self) -> None:
        """Free the memory of the time column; no finding is possible afterwards."""
        if self._clock is not None:
            self._clock.close()

    def add(self, parts: Sequence[Block], values: Array) -> None:
        """Check the next rows of every file, and their channels in order, (n, channels). Raises `UnreadableFile`,
        `UnfitRecording`.
        """
        self._require_room(self._count + len(values))
        self._add_stamps(parts, values)
        self._last = values[-1:].copy()
        missing = int(np.count_nonzero(np.isnan(values)))
        self._missing += missing
        stepped = self._increments.steps(values)
        if self._integral:
            self._integral = not missing and self._are_counts(stepped)
        self._count += len(values)

    def _add_stamps(self, parts: Sequence[Block], values: Array) -> None:
        stamps = parts[0].stamps
        if stamps is None:
            return
        if self._clock is None:
            scale = parts[0].stamp_s or self._description.time_scale_s
            self._clock = ClockColumn(scale, self._description.unwrap_clock)
        before = np.full_like(values[:1], np.nan) if self._last is None else self._last
        known = np.concatenate([before, values])
        self._clock.add(stamps, np.all(known[1:] == known[:-1], axis=1))
        for name, part in zip(self._names[1:], parts[1:], strict=True):
            if part.stamps is not None:
                self._require_same_time(name, stamps, part.stamps, part.stamp_s)

    def _require_same_time(
        self, name: str, stamps: NDArray[np.int64] | Array, others: NDArray[np.int64] | Array, other_s: float | None
    ) -> None:
        """The rows of two files have the same times, within the tolerance. Raises `UnfitRecording`."""
        clock, description = self._clock, self._description
        if clock is None:
            return
        here = stamps * clock.scale_s
        there = others * (other_s or description.time_scale_s)
        allowed = description.gap_tolerance * (clock.typical_s or 0.0)
        apart = np.flatnonzero(np.abs(there - here) > allowed)
        if len(apart):
            at = int(apart[0])
            row = self._count + at + description.rows.first
            raise UnfitRecording(
                f"{name}: row {row} is of {there[at]:.9g} s, in {self._names[0]} of {here[at]:.9g} s: files that are "
                "joined need the same times"
            )

    def _are_counts(self, values: Array) -> bool:
        """Return whether all values are whole numbers; notes the first that does not fit."""
        rows = values[1:] if self._increments.columns and not self._count else values
        if not np.array_equal(rows, np.rint(rows)):
            return False
        if self._outside is None:
            outside = np.argwhere((rows < _INT32.min) | (rows > _INT32.max))
            if len(outside):
                row, column = (int(index) for index in outside[0])
                channel = self._description.channels[column]
                at = self._count + row + len(values) - len(rows) + self._description.rows.first
                self._outside = (
                    f"{self._names[channel.file]}: row {at}, channel {channel.name!r}: {rows[row, column]:.12g} does "
                    f"not fit 32 bits; counts between {_INT32.min} and {_INT32.max} are expected"
                )
        return True

    def _require_room(self, rows: int) -> None:
        columns = len(self._description.channels) + (self._description.time_column is not None)
        if rows * columns > self._bounds.cells:
            raise UnreadableFile(
                self._names[0],
                f"{rows} rows of {columns} columns, with those that are missing, are more than {self._bounds.cells} "
                "numbers, the most for files of that size: give a part of it (rows)",
            )

    def findings(self) -> Findings:
        """Return the findings of all rows together. Raises `BadParameter`, `UnreadableFile`, `UnfitRecording`."""
        description = self._description
        if not self._count:
            first = description.rows.first
            where = f" from row {first} on" if first > 1 else ""
            raise UnreadableFile(self._names[0], f"has no rows of data{where}")
        clock, rate_hz, count = None, description.rate_hz or 0.0, self._count
        if self._clock is not None:
            column = description.time_column
            clock = judge(self._names[0], self._clock, description, column if isinstance(column, str) else "")
            rate_hz = description.rate_hz or clock.rate_hz
            count += int(clock.lost.sum()) - len(clock.repeats)
        self._require_room(count)
        count -= bool(self._increments.columns)
        if count < 1:
            raise UnreadableFile(self._names[0], "has only one row: the steps of an accumulated value need two")
        if self._integral and self._outside is not None:
            raise UnfitRecording(self._outside)
        whole = self._integral and (clock is None or not len(clock.gaps))
        return Findings(
            rate_hz=rate_hz,
            count=count,
            dtype=np.int32 if whole else np.float64,
            clock=clock,
            warnings=(*self._said_missing(), *(clock.warnings if clock else ())),
        )

    def _said_missing(self) -> tuple[str, ...]:
        if not self._missing:
            return ()
        return (f"{self._missing} cells are empty or NaN and were taken as gaps",)
