"""Allan deviation from a sample of intervals (paper A, steps 1-7): 300 of them a τ, wherever they begin.

Paper A draws them at random and finds about 1 %. The squared differences of n independent intervals of white noise give
the deviation to 1/√(2n), 4 % for 300. Here the starts go by the golden ratio: spread evenly whatever their number, and
the same each time.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.allan.integral import Integral
from procedures.analysis.allan.statistic import ALLAN, Sizes, checked_sizes
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter

GOLDEN = 0.6180339887498949
POINTS = 1 << 20
"""Points of the integral that are held; of a longer record every k-th, and τ is a whole number of k samples."""


@dataclass(frozen=True)
class Sampled:
    """Deviations from sampled intervals, (k,) each: sizes, averaging times, deviations, their uncertainties, intervals
    used.
    """

    sizes: Sizes
    tau_s: Array
    deviation: Array
    standard_uncertainty: Array
    """From the scatter of the squared differences, as of independent ones."""
    intervals: NDArray[np.int64]
    """Pairs of neighbouring intervals taken at each τ."""


class SampledStream:
    """Running Allan deviation of one channel from sampled intervals, at some sizes, in bounded memory. Gaps are
    refused.
    """

    def __init__(
        self,
        rate_hz: float,
        count: int,
        sizes: Sequence[int] | Sizes,
        intervals: int = 300,
        *,
        increments: bool = False,
    ) -> None:
        """Start. Raises `BadParameter`, `UnfitRecording` for sizes that the record does not have."""
        if not 2 <= intervals <= 1_000_000:
            raise BadParameter("intervals", intervals, "2 … 1 000 000")
        self._rate_hz, self._count, self._intervals = rate_hz, count, intervals
        self._stride = -(-count // POINTS)
        wanted = checked_sizes(sizes, count, ALLAN)
        held = np.maximum(1, np.round(wanted / self._stride)).astype(np.int64)
        most = (count // self._stride) // 2
        self._held = np.unique(np.minimum(held, max(1, most)))
        self._integral = Integral(rate_hz, increments=increments)
        self._points = np.zeros(count // self._stride + 1)
        self._index = 1

    def add(self, block: Array | NDArray[np.int32]) -> None:
        """Add the next samples of the channel, (n,). Raises `UnfitRecording` for a gap."""
        for piece in self._integral.add(block):
            first = -self._index % self._stride
            kept = piece.x[first :: self._stride]
            at = (self._index + first) // self._stride
            self._points[at : at + len(kept)] = kept
            self._index += len(piece.x)

    def finish(self) -> Sampled:
        """Return the deviations. Call once, after the last sample. Raises `UnfitRecording` where samples are
        missing.
        """
        self._integral.check_end(self._count)
        x, rows = self._points, []
        for size in self._held:
            m = int(size)
            starts = len(x) - 2 * m
            taken = min(self._intervals, starts)
            at = np.floor((GOLDEN * np.arange(1, taken + 1)) % 1.0 * starts).astype(np.int64)
            half = 0.5 * ((x[at + 2 * m] - 2.0 * x[at + m] + x[at]) / m / self._stride) ** 2
            mean = float(half.mean())
            sd = float(half.std(ddof=1)) / np.sqrt(taken) if taken > 1 else np.inf
            deviation = np.sqrt(mean)
            rows.append((m * self._stride, deviation, sd / (2.0 * deviation) if deviation > 0.0 else 0.0, taken))
        table = np.array(rows)
        sizes = table[:, 0].astype(np.int64)
        return Sampled(sizes, sizes / self._rate_hz, table[:, 1], table[:, 2], table[:, 3].astype(np.int64))
