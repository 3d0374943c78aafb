"""Whole turns of one table axis: a value, without geometry. Simulators and the analysis share it."""

from dataclasses import dataclass
from math import isfinite
from typing import Literal

AxisName = Literal["outer", "middle", "inner"]

PEAK_ACCELERATION = 1.5
"""Largest acceleration of a ramp ``3s² − 2s³`` over its mean, rate/ramp."""


@dataclass(frozen=True)
class Turn:
    """Whole turns of one axis from rest, at a constant rate, to rest at the angle where they began.

    Rate over a ramp: ``rate·(3s² − 2s³)``, s = t/ramp, and the same backwards at the end, so that the motion is
    symmetric about its middle and a ramp covers half of rate·ramp.
    """

    axis: AxisName
    turns: int
    """Number of whole turns, signed: positive by the right-hand rule about the axis."""
    rate_deg_s: float
    """Magnitude of the constant rate, above zero."""
    ramp_s: float
    """Duration of the ramp at the beginning, and again at the end."""

    def __post_init__(self) -> None:
        if self.turns == 0 or not 0.0 < self.rate_deg_s < float("inf") or not 0.0 < self.ramp_s < float("inf"):
            raise ValueError(f"{self!r}: turns must not be zero, rate and ramp finite and above zero")
        if not isfinite(self.duration_s) or abs(self.angle_deg) < self.rate_deg_s * self.ramp_s:
            raise ValueError(
                f"{self!r}: the rate is not reached, rate·ramp must be at most {abs(self.angle_deg):g} deg"
            )

    @property
    def angle_deg(self) -> float:
        """Angle of the whole turns, signed [deg]."""
        return 360.0 * self.turns

    @property
    def duration_s(self) -> float:
        """Duration from rest to rest: ``|angle|/rate + ramp`` [s]."""
        return abs(self.angle_deg) / self.rate_deg_s + self.ramp_s

    @property
    def acceleration_deg_s2(self) -> float:
        """Largest acceleration on the ramps [deg/s²]."""
        return PEAK_ACCELERATION * self.rate_deg_s / self.ramp_s
