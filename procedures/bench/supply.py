"""Port of the unit's power supply."""

from typing import Protocol


class Supply(Protocol):
    """Power switch of the unit. Both verbs are idempotent: switching on what is on is no new launch."""

    async def switch_on(self) -> None: ...

    async def switch_off(self) -> None: ...

    def is_on(self) -> bool: ...

    async def make_safe(self) -> None:
        """Switch the unit's power off."""
        ...
