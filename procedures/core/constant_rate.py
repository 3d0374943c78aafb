"""Motion of one table axis at a constant rate for some time: a value, without geometry."""

from dataclasses import dataclass
from math import isfinite

from procedures.core.turn import PEAK_ACCELERATION, AxisName


@dataclass(frozen=True)
class ConstantRate:
    """One axis from rest, at a constant rate, to rest again; the others hold.

    Rate over a ramp: ``rate·(3s² − 2s³)``, s = t/ramp, and the same backwards at the end, as in
    `procedures.core.turn.Turn`; the angle need not be whole turns.
    """

    axis: AxisName
    rate_deg_s: float
    """Constant rate, signed: positive by the right-hand rule about the axis; not zero."""
    duration_s: float
    """Duration from rest to rest, at least twice the ramp."""
    ramp_s: float
    """Duration of the ramp at the beginning, and again at the end."""

    def __post_init__(self) -> None:
        if not (isfinite(self.rate_deg_s) and self.rate_deg_s != 0.0):
            raise ValueError(f"rate_deg_s = {self.rate_deg_s!r} must be finite and not zero")
        if not 0.0 < self.ramp_s < float("inf"):
            raise ValueError(f"ramp_s = {self.ramp_s!r} must be finite and above zero")
        if not 2.0 * self.ramp_s <= self.duration_s < float("inf"):
            raise ValueError(
                f"duration_s = {self.duration_s!r} must be finite and at least two ramps, {2.0 * self.ramp_s:g}"
            )

    @property
    def angle_deg(self) -> float:
        """Angle that the axis turns, signed: ``rate·(duration − ramp)`` [deg]."""
        return self.rate_deg_s * (self.duration_s - self.ramp_s)

    @property
    def acceleration_deg_s2(self) -> float:
        """Largest acceleration on the ramps [deg/s²]."""
        return PEAK_ACCELERATION * abs(self.rate_deg_s) / self.ramp_s
