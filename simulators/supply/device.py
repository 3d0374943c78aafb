"""Supply that counts the unit's launches: implements `procedures.bench.supply.Supply`."""

from collections.abc import Callable
from typing import Any


class SimSupply:
    """Switches the unit and numbers its launches 1, 2, …"""

    def __init__(self) -> None:
        self.launches = 0
        self._on = False
        self._power_up: Callable[[int], None] = lambda _launch: None
        self._power_down: Callable[[], None] = lambda: None

    def connect(self, power_up: Callable[[int], None], power_down: Callable[[], None]) -> None:
        """Register the functions to call when the unit gets and loses its power."""
        self._power_up = power_up
        self._power_down = power_down

    def launch(self) -> int:
        """Number of the present launch, 0 while off."""
        return self.launches if self._on else 0

    async def switch_on(self) -> None:
        """Switch the unit on: a new launch, unless it is on."""
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
        return self._on

    async def make_safe(self) -> None:
        """Switch the unit off."""
        await self.switch_off()

    def checkpoint(self) -> dict[str, Any]:
        """State of the supply, from which it can resume."""
        return {"launches": self.launches, "on": self._on}

    def resume(self, state: dict[str, Any]) -> None:
        """Go on from a checkpoint, without a new launch."""
        self.launches = int(state["launches"])
        self._on = bool(state["on"])
