"""Port of the thermal chamber."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class ChamberLimits:
    """Limits of the chamber's temperature and ramp."""

    minimum_c: float
    maximum_c: float
    ramp_c_min: float
    """Fastest change of the set point."""
    ambient_c: float
    """Temperature of the chamber when the bench is made safe."""


@dataclass(frozen=True)
class ChamberReading:
    """Readings of the chamber at one moment. They are not the regressor: the unit's own sensors are."""

    time_s: float
    """Bench time of the reading [s]."""
    air_c: float
    """Air temperature at the controller's sensor."""
    set_point_c: float
    """Set point of the controller, which moves along the ramp."""
    target_c: float | None
    """Target of the present ramp; None: heater and cooler are off."""
    door_open: bool
    tripped: bool
    """The over-temperature limiter has cut heater and cooler off, and stays so until a person resets it."""


class Chamber(Protocol):
    """Thermal chamber. Each verb returns at once; temperatures change while time passes in `Clock.sleep` or
    while a recording is read. The *unit's* temperatures decide whether a soak is long enough, not the chamber's.
    """

    @property
    def limits(self) -> ChamberLimits: ...

    async def command(self, temperature_c: float, ramp_c_min: float) -> None:
        """Go to an air temperature, the set point moving at no more than this ramp.

        Raises `OutOfRange` before anything changes, `DeviceFault` where the limiter has tripped or the door is open,
        `Disconnected`.
        """
        ...

    async def read(self) -> ChamberReading:
        """Read the chamber's present state. Raises `Disconnected`."""
        ...

    async def make_safe(self) -> None:
        """Lead the chamber to ambient at its fastest ramp, in any state; where the limiter has tripped or
        the door is open it is off already. Raises `Disconnected`.
        """
        ...
