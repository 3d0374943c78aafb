"""Context of a channel's samples: inspection findings, temperatures, and whether its noise is less than a count."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import uniform_filter1d

from procedures.analysis.cells import Cells
from procedures.core.arrays import Array
from procedures.core.recording import INCREMENTS, Channel, Quantity, RawArray, RecordingInfo

LOOKED_AT = 200_000
"""Number of first samples of a channel from which its resolution is judged."""
COUNTER, CONVERTER = 0.35, 0.2
"""Variance of samples [counts²] below which the reading error is no white noise: of a counter, of a converter.

A plain counter at a constant rate has at most ¼, and ⅙ for evenly spread readings; one of independent readings with a
triangular dither has ½. Rates converted with rounding have 1/12 in addition to their own noise: below 0.12 (0.35 of a
count) the rounded noise depends on where between two counts the mean lies.
"""
_SMOOTHED_CELLS, _SMOOTHED_PART = 61, 20
_GROUPS = 256


@dataclass(frozen=True)
class ChannelContext:
    """Findings of the inspection, resolution and temperatures of one channel, for the fit of its noise."""

    findings: tuple[str, ...] = ()
    coarse: str = ""
    """Sentence on a noise of less than a count; empty where it is more."""
    temperatures: dict[str, Array] = field(default_factory=dict[str, Array])
    """Cell means (n,) of each temperature channel [its unit]."""


def temperature_names(info: RecordingInfo) -> tuple[str, ...]:
    """Return the names of a recording's temperature channels."""
    return tuple(c.name for c in info.channels if c.quantity is Quantity.TEMPERATURE)


def smooth_temperatures(cells: Cells, names: Sequence[str]) -> dict[str, Array]:
    """Return cell means of temperatures by name, averaged so that their reading noise matters little; constant ones are
    left out.
    """
    found: dict[str, Array] = {}
    for name, row in zip(cells.channels, cells.rates, strict=True):
        if name in names and np.all(np.isfinite(row)) and np.ptp(row) > 0.0:
            width = max(1, min(_SMOOTHED_CELLS, len(row) // _SMOOTHED_PART))
            found[name] = uniform_filter1d(row, width, mode="nearest")
    return found


def most_followed(series: Array, temperatures: dict[str, Array]) -> str | None:
    """Return the name of the temperature whose changes the series (n,) follows most, by correlation of successive group
    means; None without any.
    """
    size = max(1, len(series) // _GROUPS)
    count = len(series) // size
    if not temperatures or count < 3:
        return None

    def changes(row: Array) -> Array:
        return np.diff(row[: count * size].reshape(count, size).mean(axis=1))

    own = changes(series)
    by_size: dict[str, float] = {}
    for name, row in temperatures.items():
        other = changes(row)
        scale = float(np.sqrt(np.dot(own, own) * np.dot(other, other)))
        by_size[name] = abs(float(np.dot(own, other))) / scale if scale > 0.0 else 0.0
    return max(by_size, key=lambda name: by_size[name])


class Resolution:
    """Running variance of the first samples of channels that send whole counts."""

    def __init__(self, channels: Sequence[Channel]) -> None:
        self._channels = tuple(channels)
        self._parts: list[RawArray] = []
        self._seen = 0

    def add(self, block: RawArray, columns: Sequence[int]) -> None:
        """Take in the next samples (n, …); `columns` are the indices of the channels."""
        if self._seen < LOOKED_AT:
            part = block[: LOOKED_AT - self._seen][:, list(columns)]
            self._parts.append(part)
            self._seen += len(part)

    def finish(self) -> dict[str, str]:
        """Return a sentence for each channel whose noise is less than a count, by its name."""
        if not self._parts or not np.issubdtype(self._parts[0].dtype, np.integer):
            return {}
        samples = np.concatenate(self._parts)
        found: dict[str, str] = {}
        for channel, row in zip(self._channels, samples.T, strict=True):
            variance = float(np.var(row))
            if channel.quantity in INCREMENTS and 0.0 < variance < COUNTER:
                found[channel.name] = (
                    f"its samples vary by {np.sqrt(variance):.2g} counts: readings of a counter without dither "
                    "err by a sawtooth, not by white noise; of the random walk only a limit is given"
                )
            elif channel.quantity not in INCREMENTS and 0.0 < variance < CONVERTER:
                found[channel.name] = (
                    f"its samples vary by {np.sqrt(variance):.2g} counts: rounding hides most of the noise; of the "
                    "random walk only a limit is given"
                )
        return found
