"""The three-axis turntable."""

from typing import Protocol

from procedures.core.table_angles import TableAngles


class Turntable(Protocol):
    """Verbs tell time: `move_to` returns when the axes are at rest and locked, `read_angles` at once."""

    async def move_to(self, angles: TableAngles) -> None:
        """Move all axes, settle, lock. Raises `OutOfRange` before anything moves, `NotSettled`, `DeviceFault`."""
        ...

    def read_angles(self) -> TableAngles:
        """Where the encoders say the axes are."""
        ...

    async def make_safe(self) -> None:
        """Ramp down to rest and lock, whatever it was doing."""
        ...
