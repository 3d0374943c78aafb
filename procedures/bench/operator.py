"""Interface of the person at the bench, for work that no device can do."""

from typing import Protocol

from procedures.core.table_angles import TableAngles


class Operator(Protocol):
    """Operator at the bench. A request returns when the work is done; a simulated bench does it itself."""

    async def set_by_hand(self, angles: TableAngles, request: str) -> None:
        """Set the unit by hand in the attitude of these table angles; returns when the operator confirms it.

        `request` is the instruction on the operator's screen. The unit is off meanwhile. Raises `Stopped` where the
        operator refuses.
        """
        ...
