"""Rule that ends a station's dwell before its longest time: when the means are known well enough."""

from dataclasses import dataclass

from procedures.core.errors import BadParameter
from procedures.core.noise import NoiseCoefficients


@dataclass(frozen=True)
class ChannelTarget:
    """Standard uncertainty that the mean of a channel must reach, and the noise by which it is known."""

    channel: str
    target_sd: float
    """Standard uncertainty of the mean nominal output [rate]."""
    noise: NoiseCoefficients

    def __post_init__(self) -> None:
        if not 0.0 < self.target_sd < float("inf"):
            raise BadParameter(f"{self.channel}.target_sd", self.target_sd, "finite and above 0")


@dataclass(frozen=True)
class StopRule:
    """End the dwell when every channel has reached its target by the unit's own noise, and shows no other noise."""

    targets: tuple[ChannelTarget, ...]
    check_s: float = 5.0
    """Interval at which the means are looked at; a dwell is a whole number of it."""
    level: float = 1e-3
    """A dwell whose innovations are less likely than this under the declared noise continues to its longest time."""
    least_s: float = 0.0
    """Duration before which no dwell ends, for what is read at the same time (temperatures need a line)."""

    def __post_init__(self) -> None:
        if not self.targets:
            raise BadParameter("targets", self.targets, "at least one channel")
        if not 0.1 <= self.check_s <= 3600.0:
            raise BadParameter("check_s", self.check_s, "within 0.1 … 3600 s")
        if not 0.0 <= self.level < 0.5:
            raise BadParameter("level", self.level, "within 0 … 0.5")
        if not 0.0 <= self.least_s <= 86_400.0:
            raise BadParameter("least_s", self.least_s, "within 0 … 86 400 s")
