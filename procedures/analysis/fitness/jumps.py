"""Outliers and steps: a sample far from both its neighbours, and a level that shifts between two samples."""

import numpy as np

from procedures.analysis.fitness.pieces import MARGIN, Piece, Samples, largest
from procedures.core.arrays import Array

SIGMAS = 20.0
"""Standard deviations that no noise of a unit reaches."""
WHITE = 2.0 / np.sqrt(np.pi)
"""Mean magnitude of the difference of two samples of white noise of unit standard deviation."""
LEVELS = 4.0
"""Resolutions that a jump is at least: a counter at rest gives a pulse now and then, and none in between."""
STRIDE = 8
"""Every so many differences tell the noise: cheap, and one outlier in a thousand of them moves it little."""
TRUSTED = 1024
"""Fewer differences than these are judged together with those of the piece before."""
SHARP = 0.75
"""Part of a step that lies between two samples; a motion takes longer."""
LOOKED_AT = 256
"""Jumps of a piece that are told apart; where there are more the channel is no quiet one, and they are not steps."""


class Jumps:
    """Outliers and steps of all channels of a recording, against noise estimated piece by piece."""

    def __init__(self, channels: int) -> None:
        self.outliers = np.zeros(channels, np.int64)
        self.steps = np.zeros(channels, np.int64)
        self.first_outlier: list[tuple[int, float, float] | None] = [None] * channels
        """Index, the sample's distance from the mean of its neighbours, and the noise, raw."""
        self.first_step: list[tuple[int, float, float] | None] = [None] * channels
        """Index of the first sample behind the step, its height, and the noise, raw."""
        self._magnitudes = np.zeros(channels)
        self._noise_count = 0

    def add(self, piece: Piece, resolution: Array) -> None:
        """One more piece; `resolution` [raw] of each integer channel, (channels,)."""
        differences = piece.differences
        noise = self._noise(piece.d)
        if not differences.shape[1]:
            return
        limit = np.maximum(SIGMAS * noise, LEVELS * resolution)
        for c in np.flatnonzero(largest(differences) > limit / 2.0):
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
        at = begin + np.flatnonzero(np.abs(d[begin:end]) > limit / 2.0)
        first = piece.start - piece.history
        centres = at[at + 2 < len(x)] + 1
        away = x[centres] - (x[centres - 1] + x[centres + 1]) / 2.0
        apart = np.abs(x[centres + 1] - x[centres - 1])
        lonely = (np.abs(away) > limit) & (apart < np.abs(away) / 2.0)
        if lonely.any():
            self.outliers[c] += np.count_nonzero(lonely)
            k = int(np.argmax(lonely))
            self.first_outlier[c] = self.first_outlier[c] or (first + int(centres[k]), float(away[k]), noise)
        if len(at) > LOOKED_AT:
            return
        for j in at.tolist():
            height = _height(x, j)
            if abs(height) > limit and abs(d[j]) > SHARP * abs(height):
                self.steps[c] += 1
                self.first_step[c] = self.first_step[c] or (first + j + 1, height, noise)


def _height(x: Samples, j: int) -> float:
    """Of the step between samples j and j + 1: the difference of the medians of `MARGIN` samples on either side."""
    before, after = x[max(j + 1 - MARGIN, 0) : j + 1], x[j + 1 : j + 1 + MARGIN]
    if min(len(before), len(after)) < MARGIN // 2:
        return 0.0
    return float(np.median(after) - np.median(before))
