"""The precision current source of the converter's own bench: one current through the inputs of all three channels."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class CurrentSourceLimits:
    """What the source can give, and how well its certificate says that it does."""

    maximum_ma: float
    """Of either sign."""
    gain_sd_ppm: float = 0.0
    """Standard uncertainty of its gain; constant over a job."""
    zero_sd_ma: float = 0.0
    """Standard uncertainty of its current at zero; constant over a job."""


class CurrentSource(Protocol):
    """Stands outside the chamber; both verbs return at once."""

    @property
    def limits(self) -> CurrentSourceLimits: ...

    async def set_current(self, current_ma: float) -> None:
        """Give this current from now on. Raises `OutOfRange` before anything changes, `Disconnected`."""
        ...

    async def make_safe(self) -> None:
        """No current."""
        ...
