"""Supply that counts the unit's launches: implements `procedures.bench.supply.Supply`.

The unit is a resistance to it: with ``R = V_nominal²/P`` it takes ``V/R``, and a current limit below that lowers the
voltage to ``I_limit·R``. What the unit sends and how it heats itself does not follow the voltage.
"""

from collections.abc import Callable
from typing import Any

from procedures.bench.device import DeviceIdentity
from procedures.bench.errors import DeviceFault, OutOfRange
from procedures.bench.supply import SupplyLimits, SupplyReading

LIMITS = SupplyLimits(0.0, 36.0, 5.0, 28.0, 3.0)
"""Limits of a supply whose bench declares none."""


class SimSupply:
    """Switches the unit and numbers its launches 1, 2, …"""

    def __init__(self, now_s: Callable[[], float], load_w: float, limits: SupplyLimits | None = None) -> None:
        """Set up; `now_s`: bench time; `load_w`: power of the unit at the nominal voltage."""
        self.launches = 0
        self.limits = LIMITS if limits is None else limits
        self._now_s = now_s
        self._load_ohm = self.limits.nominal_v**2 / load_w if load_w > 0.0 else float("inf")
        self._set = (self.limits.nominal_v, self.limits.nominal_a)
        self._on = False
        self._tripped = False
        self._power_up: Callable[[int], None] = lambda _launch: None
        self._power_down: Callable[[], None] = lambda: None

    def connect(self, power_up: Callable[[int], None], power_down: Callable[[], None]) -> None:
        """Register the functions to call when the unit gets and loses its power."""
        self._power_up = power_up
        self._power_down = power_down

    def launch(self) -> int:
        """Number of the present launch, 0 while off."""
        return self.launches if self._on else 0

    async def identify(self) -> DeviceIdentity:
        """Identity of the simulated supply."""
        return DeviceIdentity("simulated", "power supply")

    async def set_output(self, voltage_v: float, current_a: float) -> None:
        """Set voltage and current limit. Implements `Supply.set_output`."""
        if violations := self.limits.violations(voltage_v, current_a):
            raise OutOfRange("; ".join(violations))
        self._set = (voltage_v, current_a)

    async def switch_on(self) -> None:
        """Switch the unit on: a new launch, unless it is on. Raises `DeviceFault` after a trip."""
        if self._tripped:
            raise DeviceFault("the supply's protection has tripped: a person must reset it")
        if not self._on:
            self._on = True
            self.launches += 1
            self._power_up(self.launches)

    async def switch_off(self) -> None:
        """Switch the unit's power off."""
        if self._on:
            self._on = False
            self._power_down()

    def is_on(self) -> bool:
        """Return whether the unit has power at this moment: for the world around it."""
        return self._on

    async def read(self) -> SupplyReading:
        """Measure the output. Implements `Supply.read`."""
        voltage, limit = self._set
        wanted = voltage / self._load_ohm
        limiting = self._on and wanted > limit
        current = min(wanted, limit) if self._on else 0.0
        held = current * self._load_ohm if limiting else voltage
        given = held if self._on else 0.0
        return SupplyReading(self._now_s(), self._on, given, current, limiting, self._tripped, voltage, limit)

    def trip(self) -> None:
        """Let the protection switch the output off, for good: for tests and fault plans."""
        self._tripped = True
        if self._on:
            self._on = False
            self._power_down()

    async def make_safe(self) -> None:
        """Switch the unit off, and forget the voltage that was set: what comes next begins at the nominal one."""
        await self.switch_off()
        self._set = (self.limits.nominal_v, self.limits.nominal_a)

    def checkpoint(self) -> dict[str, Any]:
        """State of the supply, from which it can resume."""
        return {"launches": self.launches, "on": self._on, "set": list(self._set), "tripped": self._tripped}

    def resume(self, state: dict[str, Any]) -> None:
        """Go on from a checkpoint, without a new launch."""
        self.launches = int(state["launches"])
        self._on = bool(state["on"])
        voltage, current = state.get("set", self._set)
        self._set = (float(voltage), float(current))
        self._tripped = bool(state.get("tripped", False))
