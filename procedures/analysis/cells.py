"""Means of a recording's rates over short cells, the basis of every slow analysis. One pass, bounded memory."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import RawArray, Recording, RecordingInfo, require_complete, require_finite


@dataclass(frozen=True)
class Cells:
    """Cell means of some channels; the last samples, less than a cell, are left out."""

    channels: tuple[str, ...]
    rates: Array
    """Shape (channels, n), each in its channel's `rate_unit`."""
    cell_s: float
    since_launch_s: float
    """Time from switching the unit on to the beginning of the first cell [s]."""


def cell_samples(rate_hz: float, cell_s: float) -> int:
    """Return the samples per cell: the whole number nearest to `cell_s`, at least one. Raises `BadParameter`."""
    if not 0.0 < cell_s < float("inf"):
        raise BadParameter("cell_s", cell_s, "finite and positive")
    return max(1, round(rate_hz * cell_s))


def channel_rows(info: RecordingInfo, names: Sequence[str], blocks: Iterator[RawArray]) -> Iterator[Array]:
    """Yield the blocks of a recording as nominal rates, channel by channel, each (channels, n), in `rate_unit`. Raises
    `MissingChannel`.
    """
    columns, scale = [info.column(name) for name in names], info.nominal_scale(names)
    for block in blocks:
        whole = columns == list(range(block.shape[1]))  # no copy but the one to floats
        rows = np.array(block.T if whole else block.T[columns], dtype=np.float64, order="C")
        scale.convert_rows(rows)
        yield rows


class CellStream:
    """Running means over short cells, from rows of rates."""

    def __init__(self, info: RecordingInfo, names: Sequence[str], cell_s: float) -> None:
        """Start with no samples. Raises `BadParameter`, and `UnfitRecording` where there is not one whole cell."""
        self._info, self._names = info, tuple(names)
        self._samples = cell_samples(info.rate_hz, cell_s)
        count = info.count // self._samples
        if count < 1:
            raise UnfitRecording(f"recording {info.id}: {info.count} samples are less than one cell of {cell_s:g} s")
        self._means = np.empty((len(self._names), count))
        self._filled = 0
        self._rest = np.empty((len(self._names), 0))

    def add(self, rows: Array) -> None:
        """Add the next samples, (channels, n); each full cell becomes a mean."""
        if self._rest.shape[1]:
            rows = np.concatenate([self._rest, rows], axis=1)
        cells = rows.shape[1] // self._samples
        used = cells * self._samples
        part = rows[:, :used].reshape(len(rows), cells, self._samples)
        self._means[:, self._filled : self._filled + cells] = part.mean(axis=2)
        self._filled += cells
        self._rest = rows[:, used:].copy()

    def finish(self) -> Cells:
        """Return all cells. Call after the last sample. Raises `UnfitRecording` where samples are missing or not
        numbers.
        """
        info = self._info
        require_complete(info, self._filled * self._samples + self._rest.shape[1])
        return Cells(self._names, self._means, self._samples / info.rate_hz, info.since_launch_s)


def cell_means(recording: Recording, names: Sequence[str], cell_s: float) -> Cells:
    """Return the cell means of some channels of a recording.

    Raises `MissingChannel`, `BadParameter`, and `UnfitRecording` where samples are not numbers, are not as many as
    announced or less than a cell.
    """
    stream = CellStream(recording.info, names, cell_s)
    for rows in channel_rows(recording.info, names, recording.blocks()):
        require_finite(recording.info, names, rows.T)
        stream.add(rows)
    return stream.finish()
