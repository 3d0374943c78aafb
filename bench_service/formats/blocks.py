"""A block of rows that a reader of files passes on to the import."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.core.arrays import Array


@dataclass(frozen=True)
class Block:
    """Rows of one file: stamps in the unit of the time column, (n,), and the channels' raw values, (n, channels).

    Stamps stay integers where they are: nanoseconds since 1970 have more digits than a double.
    """

    stamps: NDArray[np.int64] | Array | None
    values: Array
    stamp_s: float | None = None
    """Seconds in one unit of the stamps, where the file's own type gives it; None: as the description has it."""

    def __len__(self) -> int:
        return len(self.values)

    def part(self, start: int, stop: int) -> "Block":
        """Return the block of the rows start … stop − 1."""
        return Block(None if self.stamps is None else self.stamps[start:stop], self.values[start:stop], self.stamp_s)
