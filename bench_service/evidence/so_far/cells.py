"""Means of short cells of recordings that grow: each sample is read once, whatever the number of looks."""

from collections import OrderedDict
from dataclasses import dataclass, field

import numpy as np

from bench_service.evidence.recordings import RecordingSoFar
from procedures.analysis.cells import cell_samples, channel_rows
from procedures.core.arrays import Array

SHORTEST_S = 0.05
"""Length of the first cells [s]; they are joined in pairs once there are `MOST` of them."""
MOST = 8192
"""Most cells of a channel: what an Allan deviation costs stays the same however long the recording."""


@dataclass
class CellsSoFar:
    """Cell means of all channels of one recording that grows, and the samples that do not fill a cell yet."""

    rates: Array
    """Shape (channels, n), each in its channel's rate unit."""
    cell_s: float
    samples: int
    """Samples in a cell."""
    read: int = 0
    """Samples that are in the cells, or wait for the rest of one."""
    waiting: Array = field(default_factory=lambda: np.empty((0, 0)))

    def add(self, rows: Array) -> None:
        """Take in the next nominal rates, shape (channels, n); each full cell becomes a mean."""
        whole = np.concatenate([self.waiting, rows], axis=1) if self.waiting.size else rows
        count = whole.shape[1] // self.samples
        cells = whole[:, : count * self.samples].reshape(len(whole), count, self.samples).mean(axis=2)
        self.waiting = whole[:, count * self.samples :].copy()
        self.rates = np.concatenate([self.rates, cells], axis=1)
        self.read += rows.shape[1]
        while self.rates.shape[1] > MOST:
            self._join()

    def _join(self) -> None:
        odd = self.rates.shape[1] % 2
        last = np.repeat(self.rates[:, -1:], self.samples, axis=1) if odd else np.empty((len(self.rates), 0))
        self.waiting = np.concatenate([last, self.waiting], axis=1)
        even = self.rates[:, : self.rates.shape[1] - odd]
        self.rates = 0.5 * (even[:, 0::2] + even[:, 1::2])
        self.samples *= 2
        self.cell_s *= 2.0


class KeptCells:
    """Memory of the cells of the recordings that were looked at last, so that each look reads only new samples."""

    def __init__(self, most: int) -> None:
        """Set up for at most `most` recordings."""
        self._most = most
        self._known: OrderedDict[str, CellsSoFar] = OrderedDict()

    def of(self, recording: RecordingSoFar) -> CellsSoFar:
        """Return the cells of a recording's stored part; reads only what is new since the last look."""
        info = recording.info
        found = self._known.pop(info.id, None)
        if found is None:
            samples = cell_samples(info.rate_hz, SHORTEST_S)
            found = CellsSoFar(np.empty((len(info.channels), 0)), samples / info.rate_hz, samples)
        names = [channel.name for channel in info.channels]
        for rows in channel_rows(info, names, recording.since(found.read)):
            found.add(rows)
        self._known[info.id] = found
        while len(self._known) > self._most:
            self._known.popitem(last=False)
        return found
