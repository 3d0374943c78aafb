"""Sinusoidal motion of one table axis: a value, without geometry. Simulators and the analysis share it."""

from dataclasses import dataclass
from math import isfinite, pi

from procedures.core.turn import AxisName

LEAST_CYCLES = 3
"""Smallest number of cycles: the first and the last have a changing amplitude."""
LEAD_CYCLES, LEAST_LEAD_S = 2, 0.5
"""Cycles, and least time [s], after which the amplitude is constant and the servo's transient over."""
PEAK_ACCELERATION = 1.12
"""Largest acceleration over that at constant amplitude, where the amplitude grows as ``10s³ − 15s⁴ + 6s⁵`` of the first
cycle (1.1122, found by evaluation at 10⁶ points); the largest rate and excursion are those at constant amplitude.
"""


@dataclass(frozen=True)
class Sinusoid:
    """Whole cycles ``A·sin(2πft)`` of one axis about the angle where it stands, from rest to rest.

    Over the first cycle the amplitude grows from zero as ``10s³ − 15s⁴ + 6s⁵``, s = f·t, and over the last one it falls
    to zero in the same way; between them it is constant.
    """

    axis: AxisName
    amplitude_deg: float
    frequency_hz: float
    cycles: int

    def __post_init__(self) -> None:
        for name in ("amplitude_deg", "frequency_hz"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value!r} must be finite and above zero")
        if self.cycles < LEAST_CYCLES:
            raise ValueError(f"cycles = {self.cycles!r} must be at least {LEAST_CYCLES}")

    @property
    def duration_s(self) -> float:
        """Duration from rest to rest [s]."""
        return self.cycles / self.frequency_hz

    @property
    def lead_s(self) -> float:
        """Time from the begin after which the motion is taken to be steady [s]."""
        return max(LEAD_CYCLES / self.frequency_hz, LEAST_LEAD_S)

    @property
    def rate_deg_s(self) -> float:
        """Largest rate at constant amplitude, ``2πfA`` [deg/s]."""
        return 2.0 * pi * self.frequency_hz * self.amplitude_deg

    @property
    def acceleration_deg_s2(self) -> float:
        """Largest acceleration at constant amplitude, ``(2πf)²A`` [deg/s²]."""
        return 2.0 * pi * self.frequency_hz * self.rate_deg_s
