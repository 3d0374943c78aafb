"""The table as its controller has it: modes, loaded demands, limits and interlocks of each axis over the plant."""

from dataclasses import dataclass
from math import isfinite, pi

import numpy as np

from procedures.core.table_angles import TableAngles
from simulators.clock import Motion, SimClock
from simulators.served.axes import AxisPath, Paths, Swing, held, to_position, to_rate
from simulators.truth import Array, BenchTruth
from simulators.turntable.device import (
    SETTLE_S,
    SETTLED_ERROR_RAD,
    SETTLED_RATE_RAD_S,
    SimTurntable,
    pointing_error_rad,
)
from simulators.turntable.profile import MARGIN

DEG = pi / 180.0
CLOSED, OPEN, FAULT = "Closed", "Open", "Fault"
MODES = ("off", "position", "rate", "synthesis")


class Refused(Exception):
    """The controller refuses a demand; the message has its words."""


@dataclass
class AxisState:
    """State of one axis at its controller."""

    mode: str = "position"
    position_deg: float = 0.0
    rate_deg_s: float = 0.0
    oscillator: tuple[float, float, float] = (0.0, 1.0, 0.0)
    """Amplitude [deg], frequency [Hz] and phase [deg] of the synthesizer."""
    interlock: str = CLOSED


@dataclass(frozen=True)
class _Mounted:
    """Unit on the table: encoder readings [deg], joint angles [rad], whole turns, pointing error and lean [rad]."""

    encoders_deg: list[float]
    angles_rad: Array
    turns: Array
    pointing: Array
    lean: Array | None


class ControlledTable(SimTurntable):
    """The same physics as `SimTurntable`, driven axis by axis; time passes by the clock alone."""

    def __init__(self, truth: BenchTruth, seed: int, clock: SimClock) -> None:
        super().__init__(truth, seed, clock)
        description = truth.description
        self.factory = (description.outer, description.middle, description.inner)
        self.axes = (AxisState(), AxisState(), AxisState())
        self.limits: dict[tuple[str, int], list[float]] = {
            (mode, k): [axis.rate_deg_s, axis.acceleration_deg_s2]
            for mode in ("position", "rate", "synthesis")
            for k, axis in enumerate(self.factory)
        }
        """(mode, axis) -> rate [deg/s], acceleration [deg/s²]."""
        self._paths: Paths | None = None
        self.stuck_deg: list[float] | None = None
        """Encoder readings of a table whose encoders are stuck."""
        self._before: _Mounted | None = None
        """Where the unit was on the table, while a person has set it by hand elsewhere."""

    def encoders_deg(self) -> list[float]:
        """Readings of the encoders; an axis with slip rings reads within half a turn."""
        if self.stuck_deg is not None:
            return list(self.stuck_deg)
        return self.true_encoders_deg()

    def true_encoders_deg(self) -> list[float]:
        """Readings that encoders give while they are not stuck; a unit that is set by hand turns no axis."""
        if self._before is not None:
            return list(self._before.encoders_deg)
        angles = self.read_angles()
        read = [angles.outer_deg, angles.middle_deg, angles.inner_deg]
        return [
            a - 360.0 * round(a / 360.0) if limit.continuous else a for a, limit in zip(read, self.factory, strict=True)
        ]

    def place(self, angles: TableAngles, lean_rad: Array) -> None:
        """Set the unit by hand, as a person does; the table stays, and carries the unit again from its next demand."""
        before = self._before or _Mounted(
            self.true_encoders_deg(), self._plant.angles_rad.copy(), self._turns, self._pointing, self._lean
        )
        super().place(angles, lean_rad)
        self._before = before

    def load(self, kind: str, axis: int, value: float) -> None:
        """Load a demand; it acts at once where the axis is in its mode. Raises `Refused`."""
        limits, state = self.factory[axis], self.axes[axis]
        if not isfinite(value):
            raise Refused("parameter error")
        if kind == "position":
            if not limits.minimum_deg <= value <= limits.maximum_deg:
                raise Refused("position limit")
            state.position_deg = value
        else:
            if abs(value) > self.limits["rate", axis][0]:
                raise Refused("rate limit")
            state.rate_deg_s = value
        if state.mode == kind:
            self._act(axis)

    def load_oscillator(self, axis: int, amplitude_deg: float, frequency_hz: float, phase_deg: float) -> None:
        """Load a sinusoid; it begins with the synthesizer's mode. Raises `Refused` beyond the limits of that mode."""
        limits, most = self.factory[axis], self.limits["synthesis", axis]
        if not all(map(isfinite, (amplitude_deg, frequency_hz, phase_deg))) or min(amplitude_deg, frequency_hz) <= 0.0:
            raise Refused("parameter error")
        here, omega = self.axes[axis].position_deg, 2.0 * pi * frequency_hz
        if not limits.continuous and not (
            limits.minimum_deg <= here - amplitude_deg and here + amplitude_deg <= limits.maximum_deg
        ):
            raise Refused("position limit")
        if omega * amplitude_deg > most[0] or omega**2 * amplitude_deg > most[1]:
            raise Refused("rate limit" if omega * amplitude_deg > most[0] else "acceleration limit")
        if self.axes[axis].mode == "synthesis":
            raise Refused("axis is in use")
        self.axes[axis].oscillator = amplitude_deg, frequency_hz, phase_deg

    def set_limit(self, mode: str, axis: int, which: int, value: float) -> None:
        """Set rate (0) or acceleration (1) of a mode. Raises `Refused` beyond the factory's."""
        axis_limits = self.factory[axis]
        most = (axis_limits.rate_deg_s, axis_limits.acceleration_deg_s2)[which]
        if not 0.0 < value <= most:
            raise Refused("limit out of range")
        self.limits[mode, axis][which] = value

    def set_mode(self, axis: int, mode: str) -> None:
        """Set the mode of an axis; what is loaded acts from now on. Raises `Refused`."""
        if mode not in MODES:
            raise Refused("no such mode")
        if mode != "off" and self.axes[axis].interlock != CLOSED:
            raise Refused("interlock open")
        if mode == "synthesis" and (self.axes[axis].oscillator[0] == 0.0 or self._set_point(axis)[1] != 0.0):
            raise Refused("no oscillator demand" if self.axes[axis].oscillator[0] == 0.0 else "axis is moving")
        self.axes[axis].mode = mode
        self._act(axis)

    def open_interlock(self, axis: int, state: str = OPEN) -> None:
        """Open an interlock: the axis brakes and its servo goes off."""
        self.axes[axis].interlock, self.axes[axis].mode = state, "off"
        self._act(axis)

    def close_interlock(self, axis: int) -> None:
        """Close an interlock, as a person does. Raises `Refused` while its fault is not reset."""
        if self.axes[axis].interlock == FAULT:
            raise Refused("interlock fault")
        self.axes[axis].interlock = CLOSED

    def reset_interlocks(self) -> None:
        """Reset faults, as a person does: the interlocks are open then."""
        for state in self.axes:
            if state.interlock == FAULT:
                state.interlock = OPEN

    def advance(self, ticks: int) -> Motion:
        """Advance the table by some ticks. Once all axes rest it is locked: no longer stepped, its attitude
        constant (see `simulators.turntable.device`).
        """
        motion = super().advance(ticks)
        if self._paths is not None:
            self._unwind_paths()
            self._lock_at_rest()
        return motion

    def _act(self, axis: int) -> None:
        """Begin to do what is loaded in the axis' mode, from where its set point is."""
        self._put_back()
        state, (position, rate) = self.axes[axis], self._set_point(axis)
        if state.mode == "position":
            self._moves += 1
            self._pointing[axis] = pointing_error_rad(self._truth.table, self._seed, self._moves)[axis]
            most, acceleration = (DEG * MARGIN * limit for limit in self.limits["position", axis])
            path = to_position(position, rate, self._target(axis), most, acceleration)
        elif state.mode == "synthesis":
            amplitude, frequency, phase = state.oscillator
            path = Swing(position, DEG * amplitude, frequency, DEG * phase)
        else:
            target = DEG * state.rate_deg_s if state.mode == "rate" else 0.0
            path = to_rate(position, rate, target, DEG * MARGIN * self.limits["rate", axis][1])
            self._turned[axis] = self._turned[axis] or self.factory[axis].continuous
        self._follow_paths(axis, path)

    def _put_back(self) -> None:
        """Put a unit that was set by hand back on the table, as it was there."""
        if self._before is None:
            return
        before, self._before = self._before, None
        self._turns, self._pointing, self._lean = before.turns, before.pointing, before.lean
        self._plant.put(before.angles_rad)
        self._lock()

    def _target(self, axis: int) -> float:
        """Joint angle of the loaded position [rad]: with slip rings the nearest of its turns."""
        demanded = DEG * self.axes[axis].position_deg + self._pointing[axis]
        target = float(demanded - 2.0 * pi * self._turns[axis])
        if self.factory[axis].continuous:
            here = float(self._plant.angles_rad[axis])
            target += 2.0 * pi * round((here - target) / (2.0 * pi))
        return target

    def _set_point(self, axis: int) -> tuple[float, float]:
        """Position and rate of the axis' set point now [rad], [rad/s]."""
        if self._paths is None:
            return float(self._plant.angles_rad[axis]), 0.0
        position, rate = self._paths.at(np.array([self._step * self._plant.step_s]))
        return float(position[0, axis]), float(rate[0, axis])

    def _follow_paths(self, axis: int, path: AxisPath) -> None:
        paths = self._paths
        if paths is None:
            outer, middle, inner = (held(float(angle)) for angle in self._plant.angles_rad)
            paths = Paths((outer, middle, inner), (0.0, 0.0, 0.0))
        else:
            paths = paths.aged(self._step * self._plant.step_s)
        self._paths = paths.replaced(axis, path)
        self._begin(self._paths)

    def _unwind_paths(self) -> None:
        """Take whole turns out of the axes and their set points: far from zero a servo never rests."""
        turns: Array = np.rint(self._plant.angles_rad / (2.0 * np.pi))
        if self._paths is not None and np.any(turns):
            self._turns = self._turns + turns
            self._plant.shift(-2.0 * np.pi * turns)
            self._paths = self._paths.shifted(-2.0 * np.pi * turns)
            self._profile = self._paths

    def _lock_at_rest(self) -> None:
        paths = self._paths
        if paths is None or self._step * self._plant.step_s < paths.duration_s + SETTLE_S:
            return
        still = float(np.max(np.abs(self._plant.rates_rad_s))) < SETTLED_RATE_RAD_S
        if still and self._error_rad() < SETTLED_ERROR_RAD:
            self._paths = None
            self._lock()
