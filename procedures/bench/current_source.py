"""Interface of the precision current source of the converter's own bench: one current through the inputs of all three
channels.
"""

from dataclasses import dataclass
from typing import Protocol

from procedures.bench.device import Device, Status


@dataclass(frozen=True)
class CurrentSourceLimits:
    """Limits of the source and the accuracy by its certificate."""

    maximum_ma: float
    """Largest current of either sign."""
    gain_sd_ppm: float = 0.0
    """Standard uncertainty of its gain; constant over a job."""
    zero_sd_ma: float = 0.0
    """Standard uncertainty of its current at zero; constant over a job."""


@dataclass(frozen=True)
class CurrentSourceReading:
    """State of the current source at one moment: setting and status words."""

    time_s: float
    """Bench time of the reading [s]; its age is the clock's time less this."""
    set_ma: float
    """Current setting, read back; 0 where the output is off."""
    status: Status = ()


class CurrentSource(Device, Protocol):
    """Current source outside the chamber; each verb returns when the device has answered."""

    @property
    def limits(self) -> CurrentSourceLimits:
        """Limits of demands; asks nothing of the device."""
        ...

    async def set_current(self, current_ma: float) -> None:
        """Give this current from now on. Raises `OutOfRange` before anything changes, `Disconnected`."""
        ...

    async def read(self) -> CurrentSourceReading:
        """Return the present setting and status words. Raises `Disconnected`."""
        ...

    async def make_safe(self) -> None:
        """Switch the current off; returns once it reads back as off. Raises `Disconnected`."""
        ...
