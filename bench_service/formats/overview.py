"""Overview of a stretch of a recording for a plot: least, mean and greatest value of each of some hundred bins.

Samples are read a block at a time, so memory does not grow with the recording's length. Must not know where the blocks
come from.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bench_service.formats.export import Extract
from procedures.core.arrays import Array
from procedures.core.recording import NominalScale, RawArray


@dataclass(frozen=True)
class Overview:
    """Values of some channels in equal bins, in nominal rate units: each array is (bins, channels)."""

    edges: Array
    """Times of the bins' edges since the recording's first sample [s], (bins + 1,)."""
    minimum: Array
    mean: Array
    maximum: Array


def overview(part: Extract, blocks: Iterable[RawArray], bins: int) -> Overview:
    """Return the overview of a part from its samples, in order, each block (n, channels), in at most `bins` bins.

    Bin k holds the samples from ⌊k·n/bins⌋ on, so all hold the same number of samples but for one.
    """
    count, width = part.stop - part.start, len(part.info.channels)
    used = min(bins, count)
    first = np.arange(used + 1) * count // max(used, 1)
    low, high = np.full((used, width), np.inf), np.full((used, width), -np.inf)
    total = np.zeros((used, width))
    at = 0
    for block in blocks:
        inside = np.searchsorted(first, np.arange(at, at + len(block)), side="right") - 1
        starts = np.flatnonzero(np.diff(inside, prepend=-1))
        rows = inside[starts]
        low[rows] = np.minimum(low[rows], np.minimum.reduceat(block, starts, axis=0))
        high[rows] = np.maximum(high[rows], np.maximum.reduceat(block, starts, axis=0))
        total[rows] += np.add.reduceat(block.astype(np.float64), starts, axis=0)
        at += len(block)
    scale = NominalScale.of(part.info.channels, part.info.rate_hz)
    ends = np.stack([scale.rates(low), scale.rates(high)])
    mean = scale.rates(total / np.diff(first)[:, None]) if used else total
    return Overview((part.start + first) / part.info.rate_hz, ends.min(axis=0), mean, ends.max(axis=0))
