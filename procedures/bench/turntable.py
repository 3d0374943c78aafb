"""Port of the three-axis turntable."""

from typing import Protocol

from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn


class Turntable(Protocol):
    """Port of the turntable. `move_to` returns when all axes are at rest and locked, `command_turn` and `read_angles`
    at once.
    """

    async def move_to(self, angles: TableAngles) -> None:
        """Move all axes, settle, lock. Raises `OutOfRange` before anything moves, `NotSettled`, `DeviceFault`."""
        ...

    def command_turn(self, turn: Turn) -> None:
        """Begin whole turns of one axis, the others held; the table does the rest while time passes elsewhere.

        Raises `OutOfRange` before anything moves, `DeviceFault` where the table moves already.
        """
        ...

    async def settle(self) -> None:
        """Wait until the commanded motion is done and the axes are at rest and locked; at once where they are.

        Raises `NotSettled`, `DeviceFault`, `Stopped` where another demand took over.
        """
        ...

    def read_angles(self) -> TableAngles:
        """Read the present angles of the axes from the encoders."""
        ...

    def is_moving(self) -> bool:
        """True while the axes follow a demand or settle after it; safe to ask at any time."""
        ...

    async def make_safe(self) -> None:
        """Ramp down to rest and lock, from any motion."""
        ...
