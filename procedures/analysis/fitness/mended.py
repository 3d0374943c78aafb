"""Recordings without outliers and misread temperatures: other values stand in their places."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.fitness.jumps import Jump
from procedures.analysis.fitness.misreadings import Misread
from procedures.analysis.parts import of_channels
from procedures.core.recording import RawArray, Recording, RecordingInfo

Outliers = Mapping[int, Sequence[Jump | Misread]]
"""Outliers and misread temperatures by the column of their channel, one after another."""


@dataclass(frozen=True)
class Mended:
    """A recording without its outliers and misread temperatures; see `procedures.core.recording.Recording`."""

    whole: Recording
    outliers: Outliers

    @property
    def info(self) -> RecordingInfo:
        """Description of the underlying recording."""
        return self.whole.info

    def only(self, names: Sequence[str]) -> Recording:
        """Return some of the channels, in that order, without their outliers. Raises `MissingChannel`."""
        columns = [self.info.column(name) for name in names]
        found = {at: self.outliers[c] for at, c in enumerate(columns) if c in self.outliers}
        return Mended(of_channels(self.whole, names), found)

    def blocks(self) -> Iterator[RawArray]:
        """Yield the blocks without the outliers."""
        start = 0
        for block in self.whole.blocks():
            yield self._mended(block, start)
            start += len(block)

    def _mended(self, block: RawArray, start: int) -> RawArray:
        stop = start + len(block)
        mended: RawArray | None = None
        for column, found in self.outliers.items():
            first = bisect_right(found, start, key=lambda one: one.stop)
            after = bisect_left(found, stop, key=lambda one: one.start)
            for one in found[first:after]:
                mended = block.copy() if mended is None else mended
                rows = np.arange(max(one.start, start), min(one.stop, stop))
                mended[rows - start, column] = one.mended(rows, block[rows - start, column])
        return block if mended is None else mended
