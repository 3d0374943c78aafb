"""What temperature does to a unit's outputs while some ticks pass: constant from one whole second to the next.

Knows neither temperatures nor why; whoever wires the world asks the chamber's physics.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.imu.counter import Counts
from simulators.truth import Array


@dataclass(frozen=True)
class Drift:
    """A triad's departures, each (3, pieces): ``U = gain·(b + sensor_gain·a + sensor_added + noise) + added``.

    b is the bias, a what the inputs alone put through [rate], even terms included. The sensor's noise goes through the
    converter as its signal does, for it is a current too; the counter's own error comes after.
    """

    sensor_gain: Array
    sensor_added: Array
    """[rate]"""
    gain: Array
    added: Array
    """[rate]"""


@dataclass(frozen=True)
class Climate:
    """Ticks in pieces: what each does to both triads, and what the unit's temperature sensors say meanwhile."""

    lengths: NDArray[np.intp]
    """Ticks of each piece, (pieces,)."""
    gyro: Drift
    accelerometer: Drift
    codes: Counts
    """(pieces, 5)"""

    def codes_at_ticks(self) -> Counts:
        """Codes held at the sample rate, (ticks, 5)."""
        return np.repeat(self.codes, self.lengths, axis=0)
