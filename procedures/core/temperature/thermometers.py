"""Correction of a unit's temperature sensors: offset and slope of each about a reference, with one covariance.

``T = r − offset − slope·(r − reference)``, r the reading [°C]. The covariance is that of all sensors together, because
they were compared with one chamber: what its thermometer was wrong by is common to them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter


@dataclass(frozen=True)
class SensorCorrection:
    """Correction of one temperature sensor about the set's reference."""

    channel: str
    offset_c: float
    """Reading less temperature at the reference [°C]."""
    slope: float
    """Change of the offset by reading [°C/°C]."""


@dataclass(frozen=True)
class ThermometerCorrection:
    """Corrections of a unit's temperature sensors, with their common covariance."""

    sensors: tuple[SensorCorrection, ...]
    reference_c: float
    covariance: tuple[tuple[float, ...], ...]
    """Covariance of offset and slope of the first sensor, of the second, …, (2m, 2m)."""
    fitted_range_c: tuple[float, float]
    """Lowest and highest temperature of the soaks; beyond them the lines are extrapolated."""

    def __post_init__(self) -> None:
        """Check the numbers. Raises `BadParameter` for one that is not finite, and for shapes that do not agree."""
        size = 2 * len(self.sensors)
        if not self.sensors or len({s.channel for s in self.sensors}) < len(self.sensors):
            raise BadParameter("sensors", [s.channel for s in self.sensors], "at least one, each channel once")
        if np.shape(self.covariance) != (size, size):
            raise BadParameter("covariance", np.shape(self.covariance), f"({size}, {size}), offset and slope of each")
        numbers = [v for s in self.sensors for v in (s.offset_c, s.slope)]
        if not np.all(np.isfinite([*numbers, self.reference_c, *self.fitted_range_c])):
            raise BadParameter("sensors", numbers, "finite offsets, slopes, reference and range")
        if not all(abs(s.slope) < 0.5 for s in self.sensors):
            raise BadParameter(
                "slope",
                [s.slope for s in self.sensors],
                "within −0.5 … 0.5: other values are not those of a thermometer",
            )

    def has(self, channel: str) -> bool:
        """Return whether a channel's sensor was calibrated."""
        return any(s.channel == channel for s in self.sensors)

    def corrected(self, channel: str, reading_c: ArrayLike) -> Array:
        """Return the temperatures of readings of a channel [°C], of their shape. Raises `BadParameter` for an unknown
        channel.
        """
        sensor, reading = self.sensors[self._index(channel)], np.asarray(reading_c, dtype=np.float64)
        return reading - sensor.offset_c - sensor.slope * (reading - self.reference_c)

    def uncertainty_c(self, channel: str, reading_c: ArrayLike) -> Array:
        """Return the standard uncertainty of the corrected temperatures, of the shape of the readings [°C]."""
        own = self.of_pair((channel,))
        away = np.asarray(reading_c, dtype=np.float64) - self.reference_c
        variance = own[0, 0] + 2.0 * away * own[0, 1] + away**2 * own[1, 1]
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)), dtype=np.float64)

    def of_pair(self, channels: tuple[str, ...]) -> Array:
        """Return the covariance of offset and slope of some channels, in their order, (2k, 2k). Raises
        `BadParameter`.
        """
        rows = [i for c in channels for i in (2 * self._index(c), 2 * self._index(c) + 1)]
        return np.array(self.covariance, dtype=np.float64)[np.ix_(rows, rows)]

    def _index(self, channel: str) -> int:
        for index, sensor in enumerate(self.sensors):
            if sensor.channel == channel:
                return index
        known = ", ".join(s.channel for s in self.sensors)
        raise BadParameter("channel", channel, f"one that was calibrated: {known}")
