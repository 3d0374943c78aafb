"""Level and noise of every channel over short cells, in which steps and changes of the noise are sought."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.fitness.pieces import PIECE, Piece
from procedures.core.arrays import Array

LEAST_CELLS = 1024
"""Fewest cells of a recording of known length with at least as many samples; it has less than twice as many."""
NOISE_SAMPLES = 32
"""Fewest differences behind one value of the noise."""
STRIDE = 8
"""Every n-th difference is used for the noise of a long cell."""
THIN_FROM, THINNEST = 64, 4
"""Cells of more than `THIN_FROM` samples are averaged over every second sample, those of twice as many over every
`THINNEST`-th at most: half the certainty for a quarter of the time."""
UNKNOWN = 256
"""Samples a cell where the length is not announced."""


@dataclass(frozen=True)
class CellLevels:
    """Levels and noise in raw units: K cells of `size` samples, and K // `group` values of the noise."""

    size: int
    means: Array
    """Mean of every cell, (channels, K)."""
    group: int
    """Number of cells for each value of the noise."""
    noise: Array
    """Mean magnitude of the difference of two neighbours, (channels, K // group)."""

    def leave_out(self, channel: int, samples: Sequence[int]) -> None:
        """Replace each cell of a channel that contains one of these samples by the mean of its neighbours, in place."""
        for row, size in ((self.means[channel], self.size), (self.noise[channel], self.size * self.group)):
            # The difference to the next sample is in the next cell where the sample is the last of its own.
            for k in sorted({(i + late) // size for i in samples for late in (0, 1)}):
                if 0 < k < len(row) - 1:
                    row[k] = 0.5 * (row[k - 1] + row[k + 1])


class Levels:
    """Running levels and noise of cells, piece by piece; a cell never spans two pieces, and an incomplete last one is
    dropped.
    """

    def __init__(self, channels: int, count: int | None) -> None:
        """Start with no samples; `count`: the announced number of samples."""
        shortest = UNKNOWN if count is None else max(1, count // LEAST_CELLS)
        self._size = min(PIECE, 1 << (shortest.bit_length() - 1))
        self._stride = max(1, min(STRIDE, self._size // NOISE_SAMPLES // 2))
        self._means: list[Array] = [np.empty((channels, 0))]
        self._noise: list[Array] = [np.empty((channels, 0))]

    def add(self, piece: Piece) -> None:
        """Add the next piece of samples."""
        x, size = piece.x, self._size
        cells = x.shape[1] // size
        if not cells or not piece.columns.shape[1] > 1:
            return
        thinned = min(THINNEST, max(1, size // THIN_FROM))
        whole = x[:, : cells * size : thinned].astype(np.float64)
        self._means.append(whole.reshape(len(x), cells, -1).mean(axis=2) if size > 1 else whole)
        # The first sample of a recording has no difference: that of the second stands for it.
        d = piece.d if piece.d.shape[1] == x.shape[1] else np.hstack([piece.d[:, :1], piece.d])
        some = np.abs(d[:, : cells * size : self._stride].astype(np.float64))
        if some.shape[1] and d.shape[1] == x.shape[1]:
            self._noise.append(some.reshape(len(x), cells, -1).mean(axis=2))

    def finish(self) -> CellLevels:
        """Return the levels and the noise of all cells. Call after the last piece."""
        means, noise = np.hstack(self._means), np.hstack(self._noise)
        group = -(-NOISE_SAMPLES * self._stride // self._size)
        used = noise.shape[1] // group * group
        return CellLevels(
            self._size, means, group, noise[:, :used].reshape(len(noise), used // group, group).mean(axis=2)
        )
