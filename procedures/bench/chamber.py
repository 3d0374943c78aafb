"""Interface of the thermal chamber."""

from dataclasses import dataclass
from typing import Protocol

from procedures.bench.device import Device, Status
from procedures.core.errors import BadParameter


@dataclass(frozen=True)
class ChamberLimits:
    """Limits of demands of the chamber: temperature, ramp; and its ambient temperature."""

    minimum_c: float
    maximum_c: float
    ramp_c_min: float
    """Fastest change of the set point."""
    ambient_c: float
    """Temperature of the chamber when the bench is made safe."""


@dataclass(frozen=True)
class ChamberAccuracy:
    """Standard uncertainties of the air at the unit's place against the chamber's own reading, by its certificate."""

    place_sd_c: float
    """Part that is the same throughout a job: the chamber's thermometer, and the place against the sensor's [°C]."""
    soak_sd_c: float = 0.0
    """Part that is another one at each soak: what the air's fluctuation leaves in a unit that has soaked [°C]."""

    def __post_init__(self) -> None:
        for name, value in (("place_sd_c", self.place_sd_c), ("soak_sd_c", self.soak_sd_c)):
            if not 0.0 <= value <= 100.0:
                raise BadParameter(f"chamber.accuracy.{name}", value, "within 0 … 100 °C")


@dataclass(frozen=True)
class ChamberReading:
    """Readings of the chamber at one moment: air, set point, state. Thermal corrections do not use them: they use the
    unit's own sensors.
    """

    time_s: float
    """Bench time of the reading [s]; its age is the clock's time less this."""
    air_c: float
    """Air temperature at the controller's sensor."""
    set_point_c: float | None
    """Set point that moves along the ramp; None where the controller reports only the final one, `target_c`."""
    target_c: float | None
    """Final set point, where the present ramp ends, read back from the controller; None: the plant is off."""
    door_open: bool
    tripped: bool
    """The over-temperature limiter has cut heater and cooler off, and stays so until a person resets it."""
    humidity_percent: float | None = None
    """Relative humidity of the air; None where the chamber does not measure it."""
    status: Status = ()
    """Status words and messages of the controller."""


class Chamber(Device, Protocol):
    """Thermal chamber. Each verb returns when the controller has answered; temperatures change while time passes in
    `Clock.sleep` or while a recording is read. The *unit's* temperatures decide whether a soak is long enough, not the
    chamber's.
    """

    @property
    def limits(self) -> ChamberLimits:
        """Limits of demands; asks nothing of the device."""
        ...

    async def command(self, temperature_c: float, ramp_c_min: float) -> None:
        """Go to an air temperature, the set point moving at no more than this ramp.

        Raises `OutOfRange` before anything changes, `DeviceFault` where the limiter has tripped or the door is open,
        `Disconnected`.
        """
        ...

    async def read(self) -> ChamberReading:
        """Return the chamber's present air temperature, set point and status words. Raises `Disconnected`."""
        ...

    async def make_safe(self) -> None:
        """Command a running chamber to ambient at its fastest ramp; returns once the final set point reads back.

        One that is off is not started: it stays off, also where the limiter has tripped or the door is open. Raises
        `Disconnected`, `DeviceFault`.
        """
        ...
