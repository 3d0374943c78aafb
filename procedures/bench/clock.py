"""The clock of a bench, the only way for a procedure to let time pass."""

from typing import Protocol


class Clock(Protocol):
    """Clock of the bench. On a simulated bench sleeping moves the world, on a real one it waits."""

    def now_s(self) -> float:
        """Seconds since the bench was opened for the job's first launch."""
        ...

    async def sleep(self, seconds: float) -> None: ...
