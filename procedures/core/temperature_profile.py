"""Temperature profile of a thermal chamber during a recording: legs of a ramp and a soak, as plain values.

The unit's own temperatures decide when a soak is over (`procedures.analysis.thermal.profile_progress`), within the
times that a leg allows. Temperatures in °C, ramps and slopes in °C/min as chambers and people speak of them.
"""

from dataclasses import dataclass, field
from math import isfinite

from procedures.core.errors import BadParameter

MINUTE_S = 60.0


def _within(name: str, value: float, low: float, high: float) -> None:
    if not (isfinite(value) and low <= value <= high):
        raise BadParameter(name, value, f"within {low:g} … {high:g}")


@dataclass(frozen=True)
class SoakCriterion:
    """Soak criterion: case and converter of the unit both drift slowly, and the chamber's air is at its target.

    Judged from readings every `profile_progress.CHECK_S`; the slope is that of a straight line through the readings of
    the last `window_s`.
    """

    slope_c_min: float = 0.1
    """Largest drift of either sensor [°C/min]."""
    window_s: float = 300.0
    air_within_c: float = 1.5
    """Chamber's air about the leg's target: with a plant that fails the unit may well be steady elsewhere."""

    def __post_init__(self) -> None:
        _within("slope_c_min", self.slope_c_min, 1e-4, 100.0)
        _within("window_s", self.window_s, 60.0, 86_400.0)
        _within("air_within_c", self.air_within_c, 0.01, 100.0)


@dataclass(frozen=True)
class ProfileLeg:
    """One leg of a profile: go to an air temperature by a ramp, and stay until the unit has soaked."""

    target_c: float
    ramp_c_min: float
    least_soak_s: float
    """Time for which the criterion must hold without a break [s]."""
    longest_s: float
    """Longest duration from the leg's start [s]; with no soak by then the run ends with an error."""
    least_s: float = 0.0
    """Shortest duration from the leg's start [s], however soon the unit has soaked."""

    def __post_init__(self) -> None:
        _within("target_c", self.target_c, -273.0, 500.0)
        _within("ramp_c_min", self.ramp_c_min, 1e-3, 100.0)
        _within("least_soak_s", self.least_soak_s, 0.0, 604_800.0)
        _within("least_s", self.least_s, 0.0, 604_800.0)
        _within("longest_s", self.longest_s, max(60.0, self.least_s, self.least_soak_s), 604_800.0)


@dataclass(frozen=True)
class TemperatureProfile:
    """Legs of the profile in order, and the soak criterion."""

    legs: tuple[ProfileLeg, ...]
    criterion: SoakCriterion = field(default_factory=SoakCriterion)
    unit_margin_c: float = 30.0
    """A sensor of the unit further than this outside the span of targets and of its own first reading ends the run:
    the unit is protected where the chamber's own limiter comes late or not at all."""

    def __post_init__(self) -> None:
        if not self.legs:
            raise BadParameter("legs", self.legs, "at least one")
        _within("unit_margin_c", self.unit_margin_c, 1.0, 300.0)

    @property
    def longest_s(self) -> float:
        """Longest time that a run may take, over all legs [s]."""
        return sum(leg.longest_s for leg in self.legs)

    @property
    def span_c(self) -> tuple[float, float]:
        """Least and greatest target temperature."""
        targets = [leg.target_c for leg in self.legs]
        return min(targets), max(targets)

    def expected_s(self) -> float:
        """Return the duration [s] of a run in which each soak begins with the end of its ramp; the first leg begins at
        its target.
        """
        total, at = 0.0, self.legs[0].target_c
        for leg in self.legs:
            ramp_s = abs(leg.target_c - at) / leg.ramp_c_min * MINUTE_S
            total += min(max(leg.least_s, ramp_s + leg.least_soak_s), leg.longest_s)
            at = leg.target_c
        return total

    def violations(self, minimum_c: float, maximum_c: float, ramp_c_min: float) -> tuple[str, ...]:
        """Return violations of a chamber's limits, one sentence for each limit that a leg passes."""
        found: list[str] = []
        for number, leg in enumerate(self.legs, start=1):
            if not minimum_c <= leg.target_c <= maximum_c:
                found.append(f"leg {number}: {leg.target_c:g} °C is outside {minimum_c:g} … {maximum_c:g} °C")
            if leg.ramp_c_min > ramp_c_min:
                found.append(f"leg {number}: a ramp of {leg.ramp_c_min:g} °C/min is above {ramp_c_min:g} °C/min")
        return tuple(found)
