"""Effect of temperature on a unit's outputs while some ticks pass: constant from one whole second to the next.

It knows neither temperatures nor causes: the code that wires the world asks the chamber's physics.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.imu.counter import Counts
from simulators.truth import Array

Lengths = NDArray[np.intp]
"""Lengths of consecutive pieces of time in ticks, (pieces,)."""


@dataclass(frozen=True)
class Drift:
    """A triad's departures, each (3, pieces): ``U = gain·(b + sensor_gain·a + sensor_added + noise) + added``.

    b is the bias, a what the inputs alone put through [rate], even terms included. The sensor's noise goes through the
    converter as its signal does, for it is a current too; the counter's own error comes after.
    """

    lengths: Lengths
    sensor_gain: Array
    sensor_added: Array
    """Addition to the sensor's output before its noise [rate]."""
    gain: Array
    added: Array
    """Addition to the converter's output [rate]."""

    def sensed(self, bias: Array, through: Array) -> Array:
        """The sensor's own output (3, ticks) [rate] of b (3,) and a, (3, ticks) or (3, 1) where it is at rest."""
        if through.shape[1] == 1:
            return self._held(bias[:, None] + self.sensor_gain * through + self.sensor_added)
        return bias[:, None] + self._held(self.sensor_gain) * through + self._held(self.sensor_added)

    def convert(self, increments: Array, rate_hz: float) -> None:
        """Apply the converter's gain and addition to increments (3, ticks) [rate·s], in place."""
        increments *= self._held(self.gain)
        increments += self._held(self.added / rate_hz)

    def _held(self, pieces: Array) -> Array:
        return np.repeat(pieces, self.lengths, axis=1)


@dataclass(frozen=True)
class Climate:
    """Effect of temperature on both triads during some ticks (None: no effect), and the codes of the unit's sensors."""

    gyro: Drift | None
    accelerometer: Drift
    codes: Counts
    """Codes of the temperature sensors, (pieces, 5)."""

    def codes_at_ticks(self) -> Counts:
        """Repeat the codes at the sample rate, (ticks, 5)."""
        return np.repeat(self.codes, self.accelerometer.lengths, axis=0)
