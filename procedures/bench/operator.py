"""The person at the bench: what no device can do."""

from typing import Protocol

from procedures.core.table_angles import TableAngles


class Operator(Protocol):
    """Asked in words; the answer comes when the work is done. A simulated bench answers itself."""

    async def set_by_hand(self, angles: TableAngles, request: str) -> None:
        """Set the unit by hand so that it stands as it would at these table angles; returns when a person says so.

        `request` says it in words for the person's screen. The unit is off meanwhile. Raises `Stopped` where the
        person refuses.
        """
        ...
