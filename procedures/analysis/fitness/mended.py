"""Recordings without outliers: each is the mean of its two neighbours; misread temperatures are a straight line."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.fitness.jumps import Jump
from procedures.analysis.fitness.misreadings import Misread
from procedures.analysis.parts import of_channels
from procedures.core.recording import RawArray, Recording, RecordingInfo

Outliers = Mapping[int, Sequence[Jump | Misread]]
"""Outliers and misread temperatures, by the column of their channel."""


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
        inside = [
            (c, one)
            for c, found in self.outliers.items()
            for one in found
            if (start <= one.index < stop if isinstance(one, Jump) else one.start < stop and start < one.stop)
        ]
        if not inside:
            return block
        mended = block.copy()
        whole = np.issubdtype(mended.dtype, np.integer)
        for column, one in inside:
            if isinstance(one, Jump):
                mended[one.index - start, column] -= round(one.size) if whole else one.size
                continue
            rows = np.arange(max(one.start, start), min(one.stop, stop))
            line = one.straight(rows.astype(np.float64))
            mended[rows - start, column] = np.rint(line) if whole else line
        return mended
