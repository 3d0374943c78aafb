"""Samples of a recording in pieces of one size, channel by channel, however the blocks came.

The findings thus do not depend on how the recording was cut, and each examination of a piece is one call for all its
channels.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.recording import RawArray

PIECE = 16384
"""Samples a piece: six channels of it fit into the cache."""
MARGIN = 8
"""Samples on either side of a jump that are used to classify it."""
HISTORY = 2 * MARGIN + 1
"""Samples that a piece keeps of the one before: each jump is then seen once with its surroundings."""

Mask = NDArray[np.bool_]
Samples = NDArray[np.int32 | np.float64]
"""Samples that are all integers or all floats."""


@dataclass(frozen=True)
class Piece:
    """Consecutive samples of all channels. Where a sample was no number it is the channel's mean over the piece."""

    start: int
    """Index of the first new sample in the recording."""
    history: int
    """Columns that the piece before has had already: `HISTORY`, or 0 in the first piece."""
    columns: Samples
    """History and new samples, shape (channels, history + n)."""
    differences: Samples
    """Between neighbouring columns, (channels, history + n − 1)."""
    missing: Mask | None
    """Where a new sample is no number, (channels, n); None: nowhere."""
    last: bool = False

    @property
    def x(self) -> Samples:
        """The new samples, (channels, n)."""
        return self.columns[:, self.history :]

    @property
    def d(self) -> Samples:
        """Each new sample less the one before, (channels, n), in the first piece (channels, n − 1)."""
        return self.differences[:, max(self.history - 1, 0) :]

    @property
    def is_integer(self) -> bool:
        return self.columns.dtype == np.int32


class Pieces:
    """Cuts blocks of samples into pieces of one size."""

    def __init__(self, channels: int) -> None:
        self._channels = channels
        self._buffer: Samples | None = None
        self._filled = 0
        self._history = 0
        self.seen = 0
        """Number of samples received so far."""

    def add(self, block: RawArray) -> Iterator[Piece]:
        """Yield the pieces that a further block of shape (n, channels) completes. Raises `BadParameter` for another
        shape.
        """
        samples = _numbers(block, self._channels)
        buffer = self._buffer
        if buffer is None:
            buffer = self._buffer = np.empty((self._channels, HISTORY + PIECE), samples.dtype)
        if samples.dtype != buffer.dtype:
            raise BadParameter("block", str(samples.dtype), f"all blocks must be of one type, {buffer.dtype}")
        at = 0
        while at < len(samples):
            size = min(len(samples) - at, self._history + PIECE - self._filled)
            buffer[:, self._filled : self._filled + size] = samples[at : at + size].T
            self._filled += size
            self.seen += size
            at += size
            if self._filled == self._history + PIECE:
                yield self._piece(buffer, last=False)
                buffer[:, :HISTORY] = buffer[:, self._filled - HISTORY : self._filled]
                self._history = self._filled = HISTORY

    def finish(self) -> Iterator[Piece]:
        """Yield the remaining samples as the last piece, which may be without new ones; no piece without any
        samples.
        """
        if self._buffer is not None and self._filled:
            yield self._piece(self._buffer, last=True)

    def _piece(self, buffer: Samples, last: bool) -> Piece:
        columns, history = buffer[:, : self._filled], self._history
        missing = _fill(columns, history) if columns.dtype != np.int32 else None
        start = self.seen - (self._filled - history)
        return Piece(start, history, columns, _differences(columns), missing, last)


def _numbers(block: RawArray, channels: int) -> Samples:
    found = np.asarray(block)
    if found.ndim != 2 or found.shape[1] != channels:
        raise BadParameter("block", found.shape, f"must be of shape (n, {channels})")
    return found.astype(np.int32 if np.can_cast(found.dtype, np.int32) else np.float64, copy=False)


def _fill(columns: Samples, history: int) -> Mask | None:
    """Replace new samples that are not numbers, if any, by the mean of the piece, in place."""
    new = columns[:, history:]
    if not new.size or np.all(np.isfinite(new.min(axis=1)) & np.isfinite(new.max(axis=1))):
        return None
    missing = ~np.isfinite(new)
    for row, bad in zip(new, missing, strict=True):
        if bad.any():
            row[bad] = 0.0 if bad.all() else row[~bad].mean()
    return missing


def _differences(columns: Samples) -> Samples:
    if columns.dtype == np.int32 and columns.size and int(columns.max()) - int(columns.min()) >= 2**31:
        columns = columns.astype(np.float64)
    # A float64 recording of absurd size overflows to infinity, which is a jump, not an error.
    with np.errstate(over="ignore", invalid="ignore"):
        return np.diff(columns, axis=1)


def largest(values: Samples) -> Array:
    """Return the largest magnitude of each row, (channels,); zeros for no columns."""
    if not values.shape[1]:
        return np.zeros(len(values))
    return np.maximum(values.max(axis=1).astype(np.float64), -values.min(axis=1).astype(np.float64))
