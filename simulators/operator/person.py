"""Answers requests by itself: implements `procedures.bench.operator.Operator`.

It knows the chamber's door, the unit's seat and its power only as functions that it is given.
"""

from collections.abc import Callable
from typing import Any

from procedures.bench.errors import DeviceFault
from procedures.core import units
from procedures.core.table_angles import TableAngles
from simulators.clock import SimClock
from simulators.truth import Array, OperatorTruth, keyed_generator


def seat_lean_rad(truth: OperatorTruth, seed: int, setting: int) -> Array:
    """Lean of the unit in its seat after setting `setting` (1, 2, …): rotation vector in its axes, (3,) [rad]."""
    return truth.fixture_tilt_sd_arcsec * units.ARCSEC * keyed_generator(seed, "seat", block=setting).standard_normal(3)


class SimOperator:
    """Opens the chamber's door where there is one, sets the unit in its seat, closes the door."""

    def __init__(
        self,
        truth: OperatorTruth,
        seed: int,
        clock: SimClock,
        is_on: Callable[[], bool],
        door: Callable[[bool], None],
        place: Callable[[TableAngles, Array], None],
    ) -> None:
        """Set up; `is_on()`: whether the unit has power; `door(open)`, `place(angles, lean)`: move door and unit."""
        self._truth, self._seed, self._clock = truth, seed, clock
        self._is_on, self._door, self._place = is_on, door, place
        self.settings = 0
        """Number of times that the unit was set by hand."""

    async def set_by_hand(self, angles: TableAngles, request: str) -> None:
        """Set the unit by hand; `request`, a text for people, is not read. Implements `Operator.set_by_hand`.

        Raises `DeviceFault` while the unit is on or the table moves, `OutOfRange`. Even cancelled it closes the door.
        """
        self._need_off()
        self._door(True)
        try:
            await self._clock.sleep(0.5 * self._truth.set_by_hand_s)
            self._need_off()
            self._place(angles, seat_lean_rad(self._truth, self._seed, self.settings + 1))
            self.settings += 1
            await self._clock.sleep(0.5 * self._truth.set_by_hand_s)
        finally:
            self._door(False)

    def _need_off(self) -> None:
        if self._is_on():
            raise DeviceFault("the unit is on: it is switched off before it is set by hand")

    def checkpoint(self) -> dict[str, Any]:
        """State of the operator, from which it can resume."""
        return {"settings": self.settings}

    def resume(self, state: dict[str, Any]) -> None:
        """Go on from the state of a checkpoint."""
        self.settings = int(state["settings"])
