"""Progress of a unit along a temperature profile, reading by reading: the same steps live and on a recording.

The bench feeds it while a run is recorded and acts on its decisions; the analysis feeds it the recorded readings again
and gets the very same legs and soaks, so that the evidence for each soak is in the raw data and nowhere else.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from procedures.core.errors import BadParameter
from procedures.core.temperature_profile import MINUTE_S, ProfileLeg, TemperatureProfile

CHECK_S = 10.0
"""Readings are judged so often: the last sample of every such stretch of a recording."""
CASE, CONVERTER = "temperature_case", "temperature_converter"
SENSORS = (CASE, CONVERTER, "temperature_gyro_x", "temperature_gyro_y", "temperature_gyro_z")
"""Channels of the unit's own temperature sensors."""
AIR, SET_POINT = "chamber_air", "chamber_set_point"
"""Channels of the chamber's own readings, recorded with the unit's."""
DISCONNECTED_CODE = -32768
"""Code of a disconnected sensor, the least of 16 bits."""
STUCK_C = 5.0
"""Change of all other sensors but one beyond which a sensor with a constant code is stuck [°C]."""


class CheckedSamples:
    """Selects the samples of a stream that are judged: the last of every `CHECK_S`, counted through its blocks."""

    def __init__(self, rate_hz: float) -> None:
        self._step = max(1, round(CHECK_S * rate_hz))
        self._taken = 0

    def of_block(self, length: int) -> list[tuple[int, float]]:
        """Return, for each judged sample of the stream's next block of `length`, its row in the block and its time
        since the beginning [s].
        """
        before, step = self._taken, self._step
        self._taken += length
        due = range((before // step + 1) * step, self._taken + 1, step)
        return [(sample - before - 1, sample / step * CHECK_S) for sample in due]


class Standing(StrEnum):
    """State of the present leg after a reading."""

    UNDER_WAY = "under way"
    DONE = "done"
    LATE = "late"


@dataclass(frozen=True)
class LegEvidence:
    """Recorded evidence of one leg; times since the recording's beginning [s]."""

    target_c: float
    ramp_c_min: float
    began_s: float
    reached_s: float | None
    """Time when the chamber's air was first near the target."""
    soaked_s: float | None
    """Time when the criterion began to hold for good."""
    ended_s: float
    case_c: float
    """Mean temperature of the case over the criterion's window at the end of the soak."""
    converter_c: float
    """Mean temperature of the converter over the criterion's window at the end of the soak."""
    case_slope_c_min: float
    converter_slope_c_min: float
    air_c: float
    """Last reading of the chamber's air."""


_SAME_C = 1e-9
"""Readings closer than this are the same."""


class ReadingSteps:
    """Resolution of a sensor's readings, and the drift that may hide between two of them.

    The resolution is the smallest change seen. A drift of r shows as a step every q/r at the latest, so a reading that
    has stood for a time t excludes no drift under q/t. Readings that went up and down meanwhile are dithered by noise,
    and the line through them knows better.
    """

    def __init__(self) -> None:
        self.resolution_c = 0.0
        """Smallest change between two readings so far [°C]; zero before the first."""
        self._last: float | None = None
        self._changed_s = 0.0
        self._rose_s = self._fell_s = -np.inf

    def take(self, t_s: float, reading_c: float) -> None:
        """Take in one reading at a time [s]."""
        if self._last is None:
            self._last, self._changed_s = reading_c, t_s
        change = reading_c - self._last
        if abs(change) <= _SAME_C:
            return
        self.resolution_c = min(self.resolution_c or abs(change), abs(change))
        self._last, self._changed_s = reading_c, t_s
        if change > 0.0:
            self._rose_s = t_s
        else:
            self._fell_s = t_s

    def hidden_c_min(self, t_s: float, window_s: float) -> float:
        """Return the greatest drift that the readings may hide [°C/min]."""
        if min(self._rose_s, self._fell_s) >= t_s - window_s:
            return 0.0
        return self.resolution_c / max(window_s, t_s - self._changed_s) * MINUTE_S


class ProfileProgress:
    """Progress along a temperature profile. `leg` is the present one, None when all are done."""

    def __init__(self, profile: TemperatureProfile) -> None:
        self.profile = profile
        self.evidence: list[LegEvidence] = []
        """Evidence of every completed leg."""
        self._began_s = 0.0
        self._reached_s: float | None = None
        self._soaked_s: float | None = None
        self._now_s = 0.0
        self._steps = (ReadingSteps(), ReadingSteps())
        length = max(3, round(profile.criterion.window_s / CHECK_S) + 1)
        self._window: deque[tuple[float, float]] = deque(maxlen=length)
        axis = CHECK_S / MINUTE_S * (np.arange(length) - 0.5 * (length - 1))
        self._slope_of = axis / float(axis @ axis)

    @property
    def leg(self) -> ProfileLeg | None:
        done = len(self.evidence)
        return self.profile.legs[done] if done < len(self.profile.legs) else None

    @property
    def slopes_c_min(self) -> tuple[float, float]:
        """Slopes of case and converter over the window [°C/min]; NaN until it has filled."""
        if len(self._window) < len(self._slope_of):
            return float("nan"), float("nan")
        case, converter = (self._slope_of @ np.array(self._window)).tolist()
        return case, converter

    def step(self, t_s: float, case_c: float, converter_c: float, air_c: float) -> Standing:
        """Take one more reading, `CHECK_S` after the one before, `t_s` since the recording began [s].

        After `DONE` the next leg has begun, if there is one. Raises `BadParameter` where no leg is left.
        """
        leg = self.leg
        if leg is None:
            raise BadParameter("t_s", t_s, "no reading after the profile's end")
        self._now_s = t_s
        self._window.append((case_c, converter_c))
        for seen, reading in zip(self._steps, (case_c, converter_c), strict=True):
            seen.take(t_s, reading)
        criterion = self.profile.criterion
        there = abs(air_c - leg.target_c) <= criterion.air_within_c
        if there and self._reached_s is None:
            self._reached_s = t_s
        slopes = self.slopes_c_min
        slow = all(abs(slope) <= criterion.slope_c_min for slope in slopes)
        if not (there and slow and self._windowed(t_s) and not self._hidden(t_s)):
            self._soaked_s = None
        elif self._soaked_s is None:
            self._soaked_s = t_s
        since_s = t_s - self._began_s
        soaked = self._soaked_s is not None and t_s - self._soaked_s >= leg.least_soak_s
        if soaked and since_s >= leg.least_s:
            self._end(leg, t_s, slopes, air_c)
            return Standing.DONE
        return Standing.LATE if since_s >= leg.longest_s else Standing.UNDER_WAY

    def _windowed(self, t_s: float) -> bool:
        """Whether the whole window lies after the air's arrival.

        Before it the unit has only begun to follow: its slope is small because of its lag, not because it has soaked.
        """
        return self._reached_s is not None and t_s - self._reached_s >= self.profile.criterion.window_s

    def _hidden(self, t_s: float) -> str:
        """Warning where a drift beyond the limit may hide in the steps of a sensor's readings, else empty."""
        limit, window_s = self.profile.criterion.slope_c_min, self.profile.criterion.window_s
        for name, seen in zip(("case", "converter"), self._steps, strict=True):
            if seen.hidden_c_min(t_s, window_s) > limit:
                return (
                    f"the {name} reads in steps of {seen.resolution_c:g} °C, so that it must stand still for "
                    f"{seen.resolution_c / limit * MINUTE_S:.0f} s to show a drift under {limit:g} °C/min"
                )
        return ""

    def why_late(self, air_c: float) -> str:
        """Return a sentence on the criteria that the present leg does not meet."""
        leg, criterion = self.leg, self.profile.criterion
        if leg is None:
            return "nothing is late"
        number = f"leg {len(self.evidence) + 1} of {len(self.profile.legs)}, {leg.target_c:g} °C"
        if self._reached_s is None:
            what = f"the chamber's air is at {air_c:.1f} °C and has never come within {criterion.air_within_c:g} °C"
        else:
            case, converter = self.slopes_c_min
            what = (
                f"the unit still drifts by {case:+.3f} °C/min at its case and {converter:+.3f} °C/min at its converter "
                f"(allowed: {criterion.slope_c_min:g}, for {leg.least_soak_s:g} s), the air is at {air_c:.1f} °C"
            )
            what = "; ".join(filter(None, (what, self._hidden(self._now_s))))
        return f"{number}, is not soaked {leg.longest_s:g} s after it was begun: {what}"

    def _end(self, leg: ProfileLeg, t_s: float, slopes: tuple[float, float], air_c: float) -> None:
        case, converter = np.mean(np.array(self._window), axis=0).tolist()
        self.evidence.append(
            LegEvidence(
                leg.target_c,
                leg.ramp_c_min,
                self._began_s,
                self._reached_s,
                self._soaked_s,
                t_s,
                case,
                converter,
                slopes[0],
                slopes[1],
                air_c,
            )
        )
        self._began_s, self._reached_s, self._soaked_s = t_s, None, None


class SensorWatch:
    """Checks the unit's temperature sensors, reading by reading; plain arithmetic, for it runs thousands of times."""

    def __init__(self, profile: TemperatureProfile) -> None:
        low, high = profile.span_c
        self._low, self._high = low - profile.unit_margin_c, high + profile.unit_margin_c
        self._codes: list[int] = []
        self._then: list[tuple[float, ...]] = []
        """Readings of all sensors when each sensor's code last changed."""

    def step(self, codes: Sequence[int], readings_c: Sequence[float]) -> str | None:
        """Check one reading; return a sentence where a sensor is disconnected, stuck or out of the unit's range, else
        None.

        Codes and readings [°C] in the order of `SENSORS`.
        """
        if DISCONNECTED_CODE in codes:
            return f"{SENSORS[list(codes).index(DISCONNECTED_CODE)]} is disconnected: it sends code {DISCONNECTED_CODE}"
        now = tuple(readings_c)
        if not self._codes:
            self._codes, self._then = list(codes), [now] * len(now)
            self._low, self._high = min(self._low, *now), max(self._high, *now)
        for i, name in enumerate(SENSORS):
            if not self._low <= now[i] <= self._high:
                return f"{name} reads {now[i]:.1f} °C, outside {self._low:.1f} … {self._high:.1f} °C"
            if codes[i] != self._codes[i]:
                self._codes[i], self._then[i] = codes[i], now
                continue
            moved = sorted(abs(b - a) for j, (a, b) in enumerate(zip(self._then[i], now, strict=True)) if j != i)
            if moved[1] > STUCK_C:
                return (
                    f"{name} is stuck at {now[i]:.2f} °C: its code has not changed while the others moved by "
                    f"{moved[1]:.1f} °C and more"
                )
        return None
