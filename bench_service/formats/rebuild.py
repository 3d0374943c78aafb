"""Rows of a table as the samples of a recording: repeats left out, gaps marked, steps of accumulated values taken."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from bench_service.formats.description import ImportedChannel
from procedures.core.arrays import Array

_AT_ONCE = 262_144
"""Number of rows of NaN that are inserted at once."""


class Increments:
    """Running differences of accumulated channels, from row to row; the first row of all has none and is NaN there."""

    def __init__(self, channels: Sequence[ImportedChannel]) -> None:
        self.columns = [i for i, c in enumerate(channels) if c.is_accumulated]
        self._periods = [(i, c.period) for i, c in enumerate(channels) if c.period is not None]
        self._last: Array | None = None

    def steps(self, values: Array) -> Array:
        """Return the rows (n, channels) with differences in the place of accumulated values."""
        if not self.columns or not len(values):
            return values
        before = np.full((1, values.shape[1]), np.nan) if self._last is None else self._last
        self._last = values[-1:].copy()
        stepped = values.copy()
        known = np.concatenate([before, values])[:, self.columns]
        stepped[:, self.columns] = np.diff(known, axis=0)
        for column, period in self._periods:
            stepped[:, column] -= period * np.rint(stepped[:, column] / period)
        return stepped


class Rebuild:
    """Makes the rows of a recording from rows as they are read.

    `repeats` are left out; `lost` rows of NaN follow each of `gaps`; all rows are counted from 0 as they are read.
    """

    def __init__(
        self,
        channels: Sequence[ImportedChannel],
        repeats: NDArray[np.int64],
        gaps: NDArray[np.int64],
        lost: NDArray[np.int64],
    ) -> None:
        self._repeats, self._gaps, self._lost = repeats, gaps, lost
        self._increments = Increments(channels)
        self._row = 0
        self._begun = False

    def rows(self, values: Array) -> Iterator[Array]:
        """Yield the recording's rows made of the next ones, (n, channels)."""
        for block in self._whole(values):
            stepped = self._increments.steps(block)
            if self._increments.columns and not self._begun and len(stepped):
                stepped = stepped[1:]
                self._begun = True
            if len(stepped):
                yield stepped

    def _whole(self, values: Array) -> Iterator[Array]:
        begin, end = self._row, self._row + len(values)
        self._row = end
        lower, upper = np.searchsorted(self._gaps, [begin, end])
        gaps, lost = self._gaps[lower:upper] - begin, self._lost[lower:upper]
        kept = np.ones(len(values), bool)
        inside = self._repeats[np.searchsorted(self._repeats, begin) : np.searchsorted(self._repeats, end)]
        kept[inside - begin] = False
        if not len(gaps):
            yield values if kept.all() else values[kept]
            return
        place = np.cumsum(kept)[gaps]  # rows that are kept, up to the gap
        values = values[kept]
        if lost.sum() <= _AT_ONCE:
            yield np.insert(values, np.repeat(place, lost), np.nan, axis=0)
            return
        done = 0
        for at, missing in zip(place, lost, strict=True):
            yield values[done:at]
            for start in range(0, int(missing), _AT_ONCE):
                yield np.full((min(_AT_ONCE, int(missing) - start), values.shape[1]), np.nan)
            done = int(at)
        yield values[done:]
