"""Set point generator of an axis: piecewise constant acceleration to a position or to a rate, from any state."""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from simulators.truth import Array


@dataclass(frozen=True)
class Path:
    """Pieces of constant acceleration of one axis; the last one has none and continues for ever."""

    starts_s: Array
    positions: Array
    rates: Array
    accelerations: Array

    @property
    def duration_s(self) -> float:
        """Time of the last piece's beginning."""
        return float(self.starts_s[-1])

    @property
    def final_rate(self) -> float:
        """Rate after the last piece's beginning."""
        return float(self.rates[-1])

    def at(self, time_s: Array) -> tuple[Array, Array]:
        """Positions and rates at some times, each (n,)."""
        k = np.clip(np.searchsorted(self.starts_s, time_s, side="right") - 1, 0, None)
        t = time_s - self.starts_s[k]
        rate = self.rates[k] + self.accelerations[k] * t
        return self.positions[k] + 0.5 * (self.rates[k] + rate) * t, rate

    def shifted(self, by: float) -> "Path":
        """Copy of the path with `by` added to every position."""
        return Path(self.starts_s, self.positions + by, self.rates, self.accelerations)


@dataclass(frozen=True)
class Swing:
    """Endless ``A·sin(2πft + φ)`` about a position, whose amplitude and phase φ grow from zero over the first cycle.

    The growth ``10s³ − 15s⁴ + 6s⁵``, s = f·t, is this simulator's own: how a real controller begins is not known.
    """

    position: float
    amplitude: float
    frequency_hz: float
    phase: float

    @property
    def duration_s(self) -> float:
        """Infinite, for it never stands still by itself."""
        return float("inf")

    @property
    def final_rate(self) -> float:
        """Largest rate: it never stands still."""
        return 2.0 * np.pi * self.frequency_hz * self.amplitude

    def at(self, time_s: Array) -> tuple[Array, Array]:
        """Positions and rates at some times, each (n,)."""
        cycle = np.maximum(time_s, 0.0) * self.frequency_hz
        s = np.minimum(cycle, 1.0)
        size, slope = s**3 * (10.0 + s * (6.0 * s - 15.0)), 30.0 * (s * (1.0 - s)) ** 2
        turn = 2.0 * np.pi * cycle + self.phase * size
        rate = slope * np.sin(turn) + size * np.cos(turn) * (2.0 * np.pi + self.phase * slope)
        return self.position + self.amplitude * size * np.sin(turn), self.amplitude * self.frequency_hz * rate

    def shifted(self, by: float) -> "Swing":
        """Return the same motion with `by` added to every position."""
        return Swing(self.position + by, self.amplitude, self.frequency_hz, self.phase)


def held(position: float) -> Path:
    """Path of an axis that rests at one angle."""
    return _path(position, 0.0, [])


def to_rate(position: float, rate: float, target: float, acceleration: float) -> Path:
    """Path from a state to a constant rate."""
    change = target - rate
    seconds = abs(change) / acceleration
    return _path(position, rate, [(seconds, acceleration if change > 0.0 else -acceleration)], target)


def to_position(position: float, rate: float, target: float, most_rate: float, acceleration: float) -> Path:
    """Path from a state to rest at a position, never above the acceleration.

    Where braking carries the axis past the target it comes back; a rate above `most_rate` is braked down to it first.
    """
    distance = target - position
    brake = rate * abs(rate) / (2.0 * acceleration)
    sign = 1.0 if distance - brake >= 0.0 else -1.0
    there, now = sign * distance, sign * rate
    peak = min(sqrt(max(0.0, acceleration * there + 0.5 * now**2)), most_rate)
    change = peak - now
    first = acceleration if change >= 0.0 else -acceleration
    up_s, down_s = abs(change) / acceleration, peak / acceleration
    covered = 0.5 * (now + peak) * up_s + 0.5 * peak * down_s
    cruise_s = max(0.0, (there - covered) / peak) if peak > 0.0 else 0.0
    pieces = [(up_s, sign * first), (cruise_s, 0.0), (down_s, -sign * acceleration)]
    return _path(position, rate, pieces, 0.0, target)


def _path(
    position: float,
    rate: float,
    pieces: list[tuple[float, float]],
    last_rate: float = 0.0,
    last_position: float | None = None,
) -> Path:
    starts, positions, rates, accelerations = [0.0], [position], [rate], list[float]()
    for seconds, acceleration in pieces:
        accelerations.append(acceleration)
        starts.append(starts[-1] + seconds)
        positions.append(positions[-1] + rates[-1] * seconds + 0.5 * acceleration * seconds**2)
        rates.append(rates[-1] + acceleration * seconds)
    rates[-1] = last_rate
    if last_position is not None:
        positions[-1] = last_position
    return Path(np.array(starts), np.array(positions), np.array(rates), np.array([*accelerations, 0.0]))


AxisPath = Path | Swing


@dataclass(frozen=True)
class Paths:
    """Paths of three axes that began at different times: a `Profile` of the plant."""

    paths: tuple[AxisPath, AxisPath, AxisPath]
    ages_s: tuple[float, float, float]
    """Age of each path at the profile's beginning [s]."""

    @property
    def duration_s(self) -> float:
        """Time until the last axis stands still; infinite while one is to continue [s]."""
        if any(path.final_rate != 0.0 for path in self.paths):
            return float("inf")
        return max(0.0, *(path.duration_s - age for path, age in zip(self.paths, self.ages_s, strict=True)))

    def at(self, time_s: Array) -> tuple[Array, Array]:
        """Positions and rates of the axes, each (n, 3)."""
        found = [path.at(time_s + age) for path, age in zip(self.paths, self.ages_s, strict=True)]
        return np.stack([position for position, _ in found], axis=1), np.stack([rate for _, rate in found], axis=1)

    def aged(self, by_s: float) -> "Paths":
        """Return the same paths for a profile that begins `by_s` later."""
        first, second, third = self.ages_s
        return Paths(self.paths, (first + by_s, second + by_s, third + by_s))

    def shifted(self, by: Array) -> "Paths":
        """Return the same paths with `by` added to the positions of each axis."""
        outer, middle, inner = (path.shifted(float(b)) for path, b in zip(self.paths, by, strict=True))
        return Paths((outer, middle, inner), self.ages_s)

    def replaced(self, axis: int, path: AxisPath) -> "Paths":
        """Return these paths with a new one for one axis, which begins now."""
        paths, ages = list(self.paths), list(self.ages_s)
        paths[axis], ages[axis] = path, 0.0
        return Paths((paths[0], paths[1], paths[2]), (ages[0], ages[1], ages[2]))
