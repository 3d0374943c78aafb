"""Sentences on a time column: what was found is counted, with the rows as people count them, and the way out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench_service.formats.clock.column import ClockColumn, Fall
from bench_service.formats.clock.pattern import Pattern
from bench_service.formats.clock.rate import KeptRows, MeanRate
from bench_service.formats.description import TICKS, ImportDescription

SHOWN_PLACES = 5
_UNIT = {size: unit for unit, size in TICKS.items()}
NO_TIME = "leave time_column out and give rate_hz"


@dataclass(frozen=True)
class Sentences:
    """Writes the sentences for a person on a time column and its findings."""

    column: ClockColumn
    description: ImportDescription
    repeats: NDArray[np.int64]
    """Rows, from 0, that repeat the one before."""
    kept: KeptRows
    pattern: Pattern
    mean: MeanRate

    @property
    def rows(self) -> NDArray[np.int64]:
        """Rows, from 0, before each place where the number of samples and that of rows part, (k,)."""
        return self.kept.row(self.mean.places.rows)

    @property
    def gaps(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Rows, from 0, after which samples are lost, and how many."""
        positive = self.mean.places.samples > 0
        return self.rows[positive], self.mean.places.samples[positive]

    def repeated(self) -> str:
        """Return the sentence about rows that were written twice."""
        count = len(self.repeats)
        shown = [f"row {self._row(int(r))} ({self._at(int(r))})" for r in self.repeats[:SHOWN_PLACES]]
        verb = "rows repeat" if count > 1 else "row repeats"
        return f"{count} {verb} the row before, time and values: {', '.join(shown)}{_more(count)}"

    def lost(self) -> str:
        """Return the sentence about missing samples and their places."""
        rows, samples = self.gaps
        lost = self.mean.places.lost
        verb = "samples are" if lost > 1 else "sample is"
        return f"{lost} {verb} missing in {_places(len(rows))}: {self._placed(rows, samples)}"

    def surplus(self) -> str:
        """Return the sentence about rows for which the time has no room."""
        negative = self.mean.places.samples < 0
        placed = self._placed(self.rows[negative], -self.mean.places.samples[negative])
        return f"the time has no room for {self.mean.places.surplus} of the rows: {placed}"

    def range_without_gaps(self) -> list[str]:
        """Return a sentence that suggests a range of rows without gap, where all gaps are near the beginning; otherwise
        nothing.
        """
        rows, _ = self.gaps
        last = int(rows[-1]) + 1
        if last > 0.05 * self.column.count:
            return []
        return [f'rows = {{"first": {self._row(last)}}} begins after {"it" if len(rows) == 1 else "them"}']

    def done(self) -> list[str]:
        """Return sentences about rows that were left out, gaps that were marked, wraps that were continued."""
        found: list[str] = []
        if len(self.repeats):
            found.append(f"{self.repeated()}; they were left out")
        if self.mean.places.lost:
            found.append(f"{self.lost()}; NaN stands in their place")
        late = self.mean.places.late
        if len(late):
            first = self._row(int(self.kept.row(self.mean.places.late_rows[:1])[0]) + 1)
            found.append(
                f"stamps are late or early in {_places(len(late))}, the most by {int(late.max())} sample periods "
                f"(first in row {first}), with no sample lost"
            )
        wraps = self.column.wraps
        if wraps:
            times = f"{len(wraps)} time{'s' if len(wraps) > 1 else ''}"
            where = fall(wraps[0], self.column, self.description)
            found.append(f"the clock wrapped at {wraps[0].wrap} {times}, first: {where}; it was carried on")
        return found

    def arrival(self, resolution_s: float) -> list[str]:
        """Return a sentence where stamps are arrival times, or shared by several rows; otherwise nothing."""
        rate = f"the rate of {self.mean.rate_hz:.6g} Hz"
        lost = "what is lost is said apart" if self.mean.places.lost else "no sample is lost"
        if self.pattern.batch > 1:
            rows = f"{self.pattern.batch} rows at a time"
            return [
                f"arrival in batches: the stamps are those of arrival, {rows}; {lost}, and {rate} is that from batch "
                "to batch"
            ]
        if self.pattern.kind == "jitter":
            periods = f"{self.pattern.band_s * self.mean.rate_hz:.2g} sample periods"
            return [f"the stamps jitter by {periods}, as stamps of arrival do; {lost}, and {rate} is the mean one"]
        if self.pattern.kind == "coarse" and resolution_s * self.mean.rate_hz > 1.01:
            return [
                f"several rows share a stamp: the clock's resolution of {resolution_s:.3g} s is coarser than the "
                f"sample period of {1.0 / self.mean.rate_hz:.3g} s; {lost}"
            ]
        return []

    def lost_digits(self, finest_s: float, coarsest_s: float) -> list[str]:
        """Return a sentence where stamps lose enough digits as they grow for it to matter; otherwise nothing."""
        if coarsest_s * self.mean.rate_hz < 0.05:
            return []
        return [
            f"the time column lost digits in printing: its resolution goes from {finest_s:.1g} s to {coarsest_s:.1g} "
            f"s, the sample period is {1.0 / self.mean.rate_hz:.3g} s"
        ]

    def not_uniform(self) -> str:
        """Return the sentence about the stretch whose rate differs most from that of the whole."""
        begin, samples, duration, allowed = self.mean.worst
        row = self._row(int(self.kept.row(np.array([begin]))[0]))
        return (
            f"the rate is not uniform: rows {row} to {row + samples} take {duration:.6g} s where "
            f"{samples / self.mean.rate_hz:.6g} s ± {100.0 * allowed:.2g} % are expected at the mean rate of "
            f"{self.mean.rate_hz:.6g} Hz; give a range that has one rate (rows), or a larger rate_tolerance"
        )

    def _row(self, row: int) -> int:
        """Format a row as people count it, from 1 and in the whole table."""
        return row + self.description.rows.first

    def _at(self, row: int) -> str:
        return f"{float(self.column.read(row, row + 1)[0]):.6g} s from the first"

    def _placed(self, rows: NDArray[np.int64], samples: NDArray[np.int64]) -> str:
        shown = [
            f"{int(n)} between rows {self._row(int(row))} and {self._row(int(row)) + 1} ({self._at(int(row))})"
            for row, n in zip(rows[:SHOWN_PLACES], samples[:SHOWN_PLACES], strict=True)
        ]
        return ", ".join(shown) + _more(len(rows))


def fall(place: Fall, column: ClockColumn, description: ImportDescription) -> str:
    """Return the sentence about a place where the time decreases: both stamps with their rows."""
    row = place.row + description.rows.first - 1
    clock = description.time_unit == "clock"
    unit, size = ("s", 1e-9) if clock else (_UNIT[column.scale_s], 1)
    before, after = (str(v) if isinstance(v, int) else f"{v:.15g}" for v in (place.before * size, place.after * size))
    return f"{before} {unit} in row {row}, {after} {unit} in row {row + 1}"


def others(count: int) -> str:
    """Return the words about the number of further places where the time decreases."""
    return f", and falls in {count} more {'places' if count > 1 else 'place'}" if count else ""


def _places(count: int) -> str:
    return f"{count} {'places' if count > 1 else 'place'}"


def _more(count: int) -> str:
    return f" and {count - SHOWN_PLACES} more" if count > SHOWN_PLACES else ""
