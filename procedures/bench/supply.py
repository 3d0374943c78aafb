"""Interface of the unit's power supply."""

from dataclasses import dataclass
from typing import Protocol

from procedures.bench.device import Device, Status


@dataclass(frozen=True)
class SupplyLimits:
    """Range of the output that may be demanded; a bench declares it, the device may be able to do more."""

    minimum_v: float
    maximum_v: float
    maximum_a: float
    """Largest current limit."""
    nominal_v: float
    """Voltage at which the output is switched on where a station names none."""
    nominal_a: float
    """Current limit at which the output is switched on."""

    def violations(self, voltage_v: float, current_a: float | None = None) -> tuple[str, ...]:
        """Return violations of the limits by a demanded voltage and current, a sentence each."""
        found: list[str] = []
        if not self.minimum_v <= voltage_v <= self.maximum_v:
            found.append(f"voltage_v = {voltage_v:g} is outside {self.minimum_v:g} … {self.maximum_v:g}")
        if current_a is not None and not 0.0 < current_a <= self.maximum_a:
            found.append(f"current_a = {current_a:g} must be above 0 and at most {self.maximum_a:g}")
        return tuple(found)


@dataclass(frozen=True)
class SupplyReading:
    """State of the supply at one moment, as measured by it."""

    time_s: float
    """Bench time of the reading [s]; its age is the clock's time less this."""
    on: bool
    """True while the output is switched on; a trip switches it off."""
    voltage_v: float
    """Measured voltage of the output."""
    current_a: float
    """Measured current of the output."""
    limiting: bool
    """True while the current limit holds the voltage below its setting."""
    tripped: bool
    """True where a protection has switched the output off: it stays so until a person resets it."""
    set_voltage_v: float
    """Voltage setting, read back."""
    set_current_a: float
    """Current limit, read back."""
    status: Status = ()


class Supply(Device, Protocol):
    """Power supply of the unit. Every verb returns when the device has answered and the setting was read back.

    `switch_on` and `switch_off` are idempotent: switching on what is on is no new launch.
    """

    @property
    def limits(self) -> SupplyLimits:
        """Limits of demands; asks nothing of the device."""
        ...

    async def set_output(self, voltage_v: float, current_a: float) -> None:
        """Set voltage and current limit, whether the output is on or off; it is not switched.

        Raises `OutOfRange` before anything changes, `DeviceFault` where the setting reads back as another,
        `Disconnected`.
        """
        ...

    async def switch_on(self) -> None:
        """Switch the output on, at the limits' nominal values unless `set_output` has set others since the bench was
        made safe.

        Raises `DeviceFault` where a protection has tripped, `Disconnected`.
        """
        ...

    async def switch_off(self) -> None:
        """Switch the output off; returns once it reads back as off. Raises `Disconnected`."""
        ...

    async def read(self) -> SupplyReading:
        """Return measured voltage and current, the settings, and whether the output is on, limiting or tripped. Raises
        `Disconnected`.
        """
        ...

    async def make_safe(self) -> None:
        """Switch the unit's power off; returns once it reads back as off. Settings of `set_output` are forgotten: the
        next switching on is at the nominal values. Raises `Disconnected`.
        """
        ...
