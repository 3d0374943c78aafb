"""The thermal chamber."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class ChamberLimits:
    """What the chamber can be asked for."""

    minimum_c: float
    maximum_c: float
    ramp_c_min: float
    """Fastest change of the set point."""
    ambient_c: float
    """Where it goes when the bench is made safe."""


@dataclass(frozen=True)
class ChamberReading:
    """What the chamber says of itself at one moment. It is not the regressor: the unit's own sensors are."""

    time_s: float
    """Bench time."""
    air_c: float
    """At the controller's sensor."""
    set_point_c: float
    """The controller's own, which moves along the ramp."""
    target_c: float | None
    """Where it goes; None: heater and cooler are off."""
    door_open: bool
    tripped: bool
    """The over-temperature limiter has cut heater and cooler off, and stays so until a person resets it."""


class Chamber(Protocol):
    """Verbs tell time: every one of these returns at once; temperatures change while time passes in `Clock.sleep` or
    while a recording is read. Whether a soak is long enough the *unit's* temperatures say, not the chamber's.
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
        """Raises `Disconnected`."""
        ...

    async def make_safe(self) -> None:
        """Lead the chamber to ambient at its fastest ramp, whatever it was doing; where the limiter has tripped or
        the door is open it is off already. Raises `Disconnected`.
        """
        ...
