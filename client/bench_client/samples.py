"""Samples of a recording as arrays, raw as the unit sent them or in SI units with their time."""

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from bench_client.views import Channel

INCREMENTS = ("angle_increment", "velocity_increment")
RATE_UNITS = {"rad": "rad/s", "m/s": "m/s^2"}
"""Unit of an increment once it is divided by the sample period."""


@dataclass(frozen=True)
class Samples:
    """Samples of some channels over a stretch of a recording.

    A sample belongs to the beginning of its period: `time_s` is k/rate from the recording's first sample, (n,).
    """

    values: NDArray[np.float64]
    """Shape (n, channels), in `units`."""
    time_s: NDArray[np.float64]
    """Time since the recording's first sample [s], shape (n,)."""
    names: tuple[str, ...]
    units: tuple[str, ...]
    rate_hz: float

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """Return one channel, shape (n,). Raises `KeyError` with the names that there are."""
        if name not in self.names:
            raise KeyError(f"{name!r} is none of {', '.join(self.names)}")
        return self.values[:, self.names.index(name)]

    def triad(self, name: str) -> NDArray[np.float64]:
        """Return the axes x, y, z of "gyro" or "accelerometer", shape (n, 3). Raises `KeyError`."""
        return np.column_stack([self[f"{name}_{axis}"] for axis in "xyz"])


def raw_of(content: bytes) -> NDArray[np.int32] | NDArray[np.float64]:
    """Return the array in a file of an export in NumPy's format, shape (n, channels)."""
    return np.load(BytesIO(content), allow_pickle=False)


def rates_of(
    raw: NDArray[np.int32] | NDArray[np.float64], channels: Sequence[Channel], rate_hz: float, first: int
) -> Samples:
    """Convert raw samples to rates: ``scale·(raw − offset)``, an increment divided by the sample period.

    `first`: number of the first of them in the recording.
    """
    per_second = np.array([rate_hz if one.quantity in INCREMENTS else 1.0 for one in channels])
    gain = np.array([one.scale for one in channels]) * per_second
    offset = np.array([one.offset for one in channels])
    units = tuple(RATE_UNITS.get(c.unit, c.unit) if c.quantity in INCREMENTS else c.unit for c in channels)
    time_s = np.arange(first, first + len(raw)) / rate_hz
    return Samples((raw - offset) * gain, time_s, tuple(c.name for c in channels), units, rate_hz)
