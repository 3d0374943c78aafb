"""Motion profiles of the axes: reference positions and rates over time."""

from dataclasses import dataclass
from math import ceil, sqrt
from typing import Protocol

import numpy as np

from procedures.bench.description import AxisLimits
from procedures.core import units
from simulators.truth import Array

PEAK_RATE = 15.0 / 8.0
"""Largest rate of a quintic move, in units of distance/duration."""
PEAK_ACCELERATION = 10.0 / sqrt(3.0)
"""Largest acceleration of a quintic move, in units of distance/duration²."""
MARGIN = 0.98
"""Share of an axis' limits that a profile uses, so that the servo's transients stay inside."""


class Profile(Protocol):
    """A demand on the three axes (outer, middle, inner) over time from its beginning."""

    @property
    def duration_s(self) -> float: ...

    def at(self, time_s: Array) -> tuple[Array, Array]:
        """Positions [rad] and rates [rad/s] at some times, each (n, 3)."""
        ...


@dataclass(frozen=True)
class Quintic:
    """All axes from rest to rest together: ``q = q₀ + Δ·(10s³ − 15s⁴ + 6s⁵)``, s = t/T."""

    start_rad: Array
    end_rad: Array
    duration_s: float

    def at(self, time_s: Array) -> tuple[Array, Array]:
        """Positions and rates, see `Profile`; at rest after the end."""
        s = np.clip(time_s / max(self.duration_s, 1e-9), 0.0, 1.0)[:, None]
        distance = self.end_rad - self.start_rad
        position = self.start_rad + distance * (s**3 * (10.0 + s * (6.0 * s - 15.0)))
        position = np.where(s >= 1.0, self.end_rad, position)
        return position, distance * (30.0 * (s * (1.0 - s)) ** 2) / max(self.duration_s, 1e-9)


@dataclass(frozen=True)
class RampDown:
    """Every axis from its present rate to rest at its own constant deceleration."""

    start_rad: Array
    rate_rad_s: Array
    deceleration_rad_s2: Array

    @property
    def duration_s(self) -> float:
        """Duration until the last axis rests [s]."""
        return float(np.max(np.abs(self.rate_rad_s) / self.deceleration_rad_s2))

    def at(self, time_s: Array) -> tuple[Array, Array]:
        """Positions and rates, see `Profile`."""
        sign = np.sign(self.rate_rad_s)
        passed = np.minimum(time_s[:, None], np.abs(self.rate_rad_s) / self.deceleration_rad_s2)
        rate = self.rate_rad_s - sign * self.deceleration_rad_s2 * passed
        return self.start_rad + 0.5 * (self.rate_rad_s + rate) * passed, rate


@dataclass(frozen=True)
class Spin:
    """One axis from rest through an angle at a constant rate to rest, as `procedures.core.turn.Turn` describes it.

    The others hold. Of the given duration; the rate follows from it and from the angle.
    """

    start_rad: Array
    axis: int
    angle_rad: float
    duration_s: float
    ramp_s: float

    def at(self, time_s: Array) -> tuple[Array, Array]:
        """Positions and rates, see `Profile`; at rest after the end."""
        t = np.clip(time_s, 0.0, self.duration_s)
        up = np.minimum(t / self.ramp_s, 1.0)
        down = np.minimum((self.duration_s - t) / self.ramp_s, 1.0)
        rate_rad_s = self.angle_rad / (self.duration_s - self.ramp_s)
        # ∫(3s² − 2s³)ds = s³ − s⁴/2. A ramp that is over lacks half of itself; one to come lacks nothing.
        covered = t + self.ramp_s * (_covered(up) - up + down - _covered(down) - 0.5)
        position, rate = np.tile(self.start_rad, (len(t), 1)), np.zeros((len(t), 3))
        position[:, self.axis] += np.where(t >= self.duration_s, self.angle_rad, rate_rad_s * covered)
        rate[:, self.axis] = rate_rad_s * (up * up * (3.0 - 2.0 * up)) * (down * down * (3.0 - 2.0 * down))
        return position, rate


def _covered(s: Array) -> Array:
    return s**3 * (1.0 - 0.5 * s)


@dataclass(frozen=True)
class Sine:
    """One axis in whole cycles about its start, as `procedures.core.sinusoid.Sinusoid` describes it."""

    start_rad: Array
    axis: int
    amplitude_rad: float
    frequency_hz: float
    cycles: int

    @property
    def duration_s(self) -> float:
        """Duration from rest to rest [s]."""
        return self.cycles / self.frequency_hz

    def at(self, time_s: Array) -> tuple[Array, Array]:
        """Positions and rates, see `Profile`; at rest after the end."""
        cycle = np.clip(time_s * self.frequency_hz, 0.0, self.cycles)
        up, down = np.minimum(cycle, 1.0), np.minimum(self.cycles - cycle, 1.0)
        size, turn = _grown(up) * _grown(down), 2.0 * np.pi
        slope = _growth(up) * _grown(down) - _grown(up) * _growth(down)
        position, rate = np.tile(self.start_rad, (len(cycle), 1)), np.zeros((len(cycle), 3))
        wave = np.sin(turn * cycle)
        position[:, self.axis] += self.amplitude_rad * size * wave
        per_cycle = slope * wave + turn * size * np.cos(turn * cycle)
        rate[:, self.axis] = self.amplitude_rad * self.frequency_hz * per_cycle
        return position, rate


def _grown(s: Array) -> Array:
    return s**3 * (10.0 + s * (6.0 * s - 15.0))


def _growth(s: Array) -> Array:
    return 30.0 * (s * (1.0 - s)) ** 2


def move_ticks(distance_deg: Array, limits: tuple[AxisLimits, ...], rate_hz: float) -> int:
    """Return the number of whole ticks that a quintic move of all axes together needs within every axis' rate and
    acceleration.
    """
    longest = 0.0
    for distance, limit in zip(np.abs(distance_deg).tolist(), limits, strict=True):
        by_rate = PEAK_RATE * distance / (MARGIN * limit.rate_deg_s)
        by_acceleration = sqrt(PEAK_ACCELERATION * distance / (MARGIN * limit.acceleration_deg_s2))
        longest = max(longest, by_rate, by_acceleration)
    return ceil(longest * rate_hz)


def deceleration_rad_s2(limits: tuple[AxisLimits, ...]) -> Array:
    """Deceleration of a stop, (3,), which equals the axes' limits."""
    return MARGIN * units.DEG * np.array([limit.acceleration_deg_s2 for limit in limits])
