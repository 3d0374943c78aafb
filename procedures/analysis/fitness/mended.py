"""Recordings whose few outliers are replaced by the mean of their two neighbours."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.fitness.jumps import Jump
from procedures.analysis.parts import of_channels
from procedures.core.recording import RawArray, Recording, RecordingInfo


@dataclass(frozen=True)
class Mended:
    """A recording without its outliers; see `procedures.core.recording.Recording`."""

    whole: Recording
    outliers: Mapping[int, Sequence[Jump]]
    """Outliers by the column of their channel."""

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
        inside = [
            (jump.index - start, c, jump.size)
            for c, jumps in self.outliers.items()
            for jump in jumps
            if start <= jump.index < start + len(block)
        ]
        if not inside:
            return block
        mended = block.copy()
        for row, column, away in inside:
            mended[row, column] -= round(away) if np.issubdtype(mended.dtype, np.integer) else away
        return mended
