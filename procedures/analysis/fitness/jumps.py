"""Outliers and steps: a sample far from both its neighbours, and a level that shifts between two samples."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.fitness.pieces import MARGIN, Piece, Samples, largest
from procedures.core.arrays import Array
from procedures.core.recording import RawArray

SIGMAS = 12.0
"""Standard deviations that no noise of a unit reaches."""
WHITE = 2.0 / np.sqrt(np.pi)
"""Mean magnitude of the difference of two samples of white noise of unit standard deviation."""
LEVELS = 4.0
"""Least jump in resolutions: a counter at rest gives a single pulse now and then."""
STRIDE = 8
"""Every n-th difference is used for the noise: cheap, and one outlier in a thousand of them moves it little."""
TRUSTED = 1024
"""Fewest differences that are judged alone; fewer are combined with those of the previous pieces."""
SHARP = 0.75
"""Part of a step, and of either side of an outlier, that lies between two samples; a motion takes longer."""
LOOKED_AT = 256
"""Most jumps of a piece that are classified; a channel with more is not quiet, and they are not steps."""
LONELY = 3.0
"""Least ratio of an outlier's distance to any distance of neighbouring samples around it."""
KEPT = 1000
"""Most outliers and steps that are kept for a channel; further ones are only counted."""


@dataclass(frozen=True)
class Jump:
    """One outlier or one step: index of the sample, size, and the noise around it."""

    index: int
    """The outlying sample, or the first one after the step."""
    size: float
    """Raw: from the mean of its two neighbours, or the height."""
    noise: float
    """Raw standard deviation that it was judged against."""

    @property
    def start(self) -> int:
        """Index of the sample."""
        return self.index

    @property
    def stop(self) -> int:
        """Index after the sample."""
        return self.index + 1

    def mended(self, _indices: NDArray[np.int64], values: RawArray) -> Array:
        """Return the outlying sample, (1,), moved to the mean of its neighbours, whole where `values` are."""
        size = round(self.size) if np.issubdtype(values.dtype, np.integer) else self.size
        return values.astype(np.float64) - size


class Jumps:
    """Outliers and steps of all channels of a recording, sought piece by piece against the noise."""

    def __init__(self, channels: int) -> None:
        self.outlier_count = np.zeros(channels, np.int64)
        self.outliers: list[list[Jump]] = [[] for _ in range(channels)]
        self.steps: list[list[Jump]] = [[] for _ in range(channels)]
        self._magnitudes = np.zeros(channels)
        self._noise_count = 0

    def add(self, piece: Piece, resolution: Array) -> None:
        """Seek outliers and steps in one more piece; `resolution` [raw] of each integer channel, (channels,)."""
        differences = piece.differences
        noise = self._noise(piece.d)
        if not differences.shape[1]:
            return
        limit = np.maximum(SIGMAS * noise, LEVELS * resolution)
        for c in np.flatnonzero(largest(differences) > SHARP * limit):
            self._channel(piece, int(c), float(noise[c]), float(limit[c]))

    def _noise(self, d: Samples) -> Array:
        """Standard deviation of white noise with the mean magnitude of some differences, (channels,)."""
        few = d[:, :: STRIDE if d.shape[1] >= TRUSTED else 1].astype(np.float64)
        sums, count = np.abs(few).sum(axis=1), few.shape[1]
        both = self._magnitudes + sums, self._noise_count + count
        self._magnitudes, self._noise_count = (sums, count) if d.shape[1] >= TRUSTED else both
        total, number = (sums, count) if d.shape[1] >= TRUSTED else both
        return total / max(number, 1) / WHITE

    def _channel(self, piece: Piece, c: int, noise: float, limit: float) -> None:
        x, d = piece.columns[c].astype(np.float64), piece.differences[c].astype(np.float64)
        if not piece.is_integer:
            magnitudes = np.abs(d)
            limit = max(limit, LEVELS * float(np.min(magnitudes[magnitudes > 0.0], initial=np.inf)))
        begin, end = MARGIN if piece.history else 0, len(d) if piece.last else len(d) - MARGIN
        at = begin + np.flatnonzero(np.abs(d[begin:end]) > SHARP * limit)
        first = piece.start - piece.history
        centres = at[at + 2 < len(x)] + 1
        away = x[centres] - (x[centres - 1] + x[centres + 1]) / 2.0
        apart = np.abs(x[centres + 1] - x[centres - 1])
        lonely = (np.abs(away) > limit) & (apart < np.abs(away) / 2.0)
        for k in np.flatnonzero(lonely).tolist():
            if not _alone(d, int(centres[k]), float(away[k])):
                continue
            self.outlier_count[c] += 1
            if len(self.outliers[c]) < KEPT:
                self.outliers[c].append(Jump(first + int(centres[k]), float(away[k]), noise))
        if len(at) > LOOKED_AT:
            return
        for j in at.tolist():
            height = _height(x, j)
            if abs(height) > limit and abs(d[j]) > SHARP * abs(height) and len(self.steps[c]) < KEPT:
                self.steps[c].append(Jump(first + j + 1, height, noise))


def _alone(d: Samples, centre: int, away: float) -> bool:
    """True if the differences around an outlier, except its own two, are small relative to it: no burst of noise."""
    about = np.concatenate([d[max(centre - MARGIN, 0) : centre - 1], d[centre + 1 : centre + MARGIN]])
    if not len(about):
        return True
    # One other outlier may stand there: it makes two large differences.
    return bool(np.sort(np.abs(about))[max(len(about) - 3, 0)] * LONELY < abs(away))


def _height(x: Samples, j: int) -> float:
    """Height of the step from sample j to j + 1: the difference of the medians of `MARGIN` samples on either side."""
    before, after = x[max(j + 1 - MARGIN, 0) : j + 1], x[j + 1 : j + 1 + MARGIN]
    if min(len(before), len(after)) < MARGIN // 2:
        return 0.0
    return float(np.median(after) - np.median(before))
