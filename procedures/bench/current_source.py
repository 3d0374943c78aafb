"""The precision current source of the converter's own bench: one current through the inputs of all three channels."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class CurrentSourceLimits:
    """Limits of the source and the accuracy by its certificate."""

    maximum_ma: float
    """Largest current of either sign."""
    gain_sd_ppm: float = 0.0
    """Standard uncertainty of its gain; constant over a job."""
    zero_sd_ma: float = 0.0
    """Standard uncertainty of its current at zero; constant over a job."""


class CurrentSource(Protocol):
    """Current source outside the chamber; both verbs return at once."""

    @property
    def limits(self) -> CurrentSourceLimits: ...

    async def set_current(self, current_ma: float) -> None:
        """Give this current from now on. Raises `OutOfRange` before anything changes, `Disconnected`."""
        ...

    async def make_safe(self) -> None:
        """Switch the current off."""
        ...
