"""Context of a channel's samples: inspection findings, temperatures, and whether its noise is less than a step."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import uniform_filter1d

from procedures.analysis.cells import Cells
from procedures.analysis.launch.resolution import Coarse
from procedures.core.arrays import Array
from procedures.core.recording import Quantity, RecordingInfo

_SMOOTHED_CELLS, _SMOOTHED_PART = 61, 20
_GROUPS = 256


@dataclass(frozen=True)
class ChannelContext:
    """Findings of the inspection, resolution and temperatures of one channel, for the fit of its noise."""

    findings: tuple[str, ...] = ()
    coarse: Coarse | None = None
    """Step that hides the noise; None where the noise is more."""
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
