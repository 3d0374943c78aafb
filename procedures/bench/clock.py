"""The clock of a bench, the only way for a procedure to let time pass."""

from typing import Protocol


class Clock(Protocol):
    """Clock of the bench. A sleep computes a simulated bench onwards, and waits on a real one."""

    def now_s(self) -> float:
        """Return the seconds since the bench was opened for the job's first launch."""
        ...

    async def sleep(self, seconds: float) -> None: ...
