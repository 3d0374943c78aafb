"""Three-axis table on a simulated bench: implements `procedures.bench.turntable.Turntable`.

Time moves the table (`advance`, called by the clock); its verbs only give it profiles and let time pass. At rest it is
locked: not stepped, its attitude constant. Angles are wrapped by whole turns at standstill and while turning, the turns
kept aside; an axis with slip rings forgets them when it has turned, as an encoder of one turn does.
"""

from dataclasses import replace
from math import ceil
from typing import Any

import numpy as np

from procedures.bench.description import BenchDescription
from procedures.bench.device import DeviceIdentity
from procedures.bench.errors import DeviceFault, NotSettled, OutOfRange, Stopped
from procedures.bench.turntable import NO_TRACE, EncoderTrace, TableReading, appended
from procedures.core import units
from procedures.core.constant_rate import ConstantRate
from procedures.core.sinusoid import Sinusoid
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn
from simulators.clock import Motion, SimClock
from simulators.truth import Array, BenchTruth, TableTruth, keyed_generator
from simulators.turntable.kinematics import at_rest, attitude, path_increments, small_turn
from simulators.turntable.plant import Plant
from simulators.turntable.profile import Profile, Quintic, RampDown, Sine, Spin, deceleration_rad_s2, move_ticks

AXES = ("outer", "middle", "inner")
SLICE_S = 0.25
SETTLE_SLICE_S = 0.05
SETTLED_ERROR_RAD = 1e-3 * units.ARCSEC
SETTLED_RATE_RAD_S = 1e-6 * units.DEG_PER_HOUR
SETTLE_S = 0.5
"""Time after the end of its profile before which a move is not called settled [s]."""
SETTLE_TIMEOUT_S = 10.0


def pointing_error_rad(table: TableTruth, seed: int, move: int) -> Array:
    """True angle minus encoder of each axis after move number `move`, (3,); the table begins without, at move 0."""
    if move == 0:
        return np.zeros(3)
    draw = keyed_generator(seed, "pointing", block=move).standard_normal(3)
    return table.pointing_sd_arcsec * units.ARCSEC * draw


class SimTurntable:
    """Three-axis table that checks its limits before each motion; a fault of the plant stays for good."""

    def __init__(self, truth: BenchTruth, seed: int, clock: SimClock) -> None:
        self._truth = truth
        self._seed = seed
        self._clock = clock
        description: BenchDescription = truth.description
        self._description = description
        self._limits = (description.outer, description.middle, description.inner)
        self._plant = Plant(truth.table, truth.site, description.site.azimuth_deg, clock.rate_hz)
        self._turns = np.zeros(3)
        self._pointing = np.zeros(3)
        self._turned = np.zeros(3, dtype=bool)
        self._moves = 0
        self._profile: Profile | None = None
        self._step = 0
        self._demand = 0
        self._fault = ""
        self._traced = NO_TRACE
        self._lean: Array | None = None
        """Rotation vector of the unit on the inner axis, (3,) [rad]; None: it is mounted exactly."""
        self._rest = self._at_rest()

    @property
    def locked(self) -> bool:
        """True while the axes are at rest and held."""
        return self._profile is None

    async def move_to(self, angles: TableAngles) -> None:
        """Move all axes, settle, lock. Implements `Turntable.move_to`."""
        self._need_leave(self._description.violations(angles))
        self._moves += 1
        self._pointing = pointing_error_rad(self._truth.table, self._seed, self._moves)
        demanded = units.DEG * np.array([angles.outer_deg, angles.middle_deg, angles.inner_deg])
        start, end = self._plant.angles_rad, demanded + self._pointing - 2.0 * np.pi * self._turns
        duration = move_ticks((end - start) / units.DEG, self._limits, self._clock.rate_hz) / self._clock.rate_hz
        await self._follow(Quintic(start, end, duration))

    async def command_turn(self, turn: Turn) -> None:
        """Begin whole turns of one axis, which stops with a new pointing error. Implements `Turntable.command_turn`."""
        self._need_leave(self._description.violations(self.read_angles(), turn))
        axis = AXES.index(turn.axis)
        self._moves += 1
        pointing = pointing_error_rad(self._truth.table, self._seed, self._moves)[axis]
        angle = units.DEG * turn.angle_deg + pointing - self._pointing[axis]
        self._pointing[axis] = pointing
        self._turned[axis] = self._description.axis(turn.axis).continuous
        self._begin(Spin(self._plant.angles_rad, axis, angle, turn.duration_s, turn.ramp_s))

    async def command_rate(self, rate: ConstantRate) -> None:
        """Begin a constant rate of one axis, whose pointing error stays. Implements `Turntable.command_rate`."""
        self._need_leave(self._description.rate_violations(self.read_angles(), rate))
        axis = AXES.index(rate.axis)
        self._turned[axis] = self._description.axis(rate.axis).continuous
        angle = units.DEG * rate.angle_deg
        self._begin(Spin(self._plant.angles_rad, axis, angle, rate.duration_s, rate.ramp_s))

    async def command_sinusoid(self, sinusoid: Sinusoid) -> None:
        """Begin whole cycles of one axis. Implements `Turntable.command_sinusoid`."""
        self._need_leave(self._description.sinusoid_violations(self.read_angles(), sinusoid))
        amplitude = units.DEG * sinusoid.amplitude_deg
        axis = AXES.index(sinusoid.axis)
        self._begin(Sine(self._plant.angles_rad, axis, amplitude, sinusoid.frequency_hz, sinusoid.cycles))

    def trace(self) -> EncoderTrace:
        """Return a sinusoid's readings since the last call, one a tick, timed exactly. Implements `Turntable.trace`."""
        taken, self._traced = self._traced, NO_TRACE
        return taken

    async def settle(self) -> None:
        """Let time pass until the commanded motion is over and the axes rest. Raises `DeviceFault` of a plant that
        failed, `NotSettled`, `Stopped`. Implements `Turntable.settle`.
        """
        if self._fault:
            raise DeviceFault(self._fault)
        if self._profile is not None:
            await self._finish(self._profile, self._demand)

    def place(self, angles: TableAngles, lean_rad: Array) -> None:
        """Set the unit by hand as at these angles, leaning by a rotation vector (3,) in its own axes.

        No servo moves, no time passes; the lean stays until the next setting. Raises `OutOfRange`, `DeviceFault`.
        """
        self._need_leave(self._description.violations(angles))
        self._turns, self._pointing = np.zeros(3), np.zeros(3)
        self._plant.put(units.DEG * np.array([angles.outer_deg, angles.middle_deg, angles.inner_deg]))
        self._lean = np.array(lean_rad, dtype=np.float64)
        self._lock()

    def _need_leave(self, violations: tuple[str, ...]) -> None:
        """Check the limits first, then whether the table may move at all."""
        if violations:
            raise OutOfRange("; ".join(violations))
        if self._fault:
            raise DeviceFault(self._fault)
        if not self.locked:
            raise DeviceFault("the table is moving: wait for the end of its motion")

    async def identify(self) -> DeviceIdentity:
        """Identity of the simulated table."""
        return DeviceIdentity("simulated", "three-axis table", self._description.id)

    async def read(self) -> TableReading:
        """Return encoder angles, rates, and whether it moves. Implements `Turntable.read`."""
        outer, middle, inner = self.read_rates_deg_s().tolist()
        return TableReading(
            self._clock.now_s(), self.read_angles(), not self.locked, rates_deg_s=(outer, middle, inner)
        )

    def read_angles(self) -> TableAngles:
        """Return what the encoders read now, whole turns included, without the pointing error."""
        encoders = (self._plant.angles_rad - self._pointing + 2.0 * np.pi * self._turns) / units.DEG
        outer, middle, inner = encoders.tolist()
        return TableAngles(outer, middle, inner)

    def read_rates_deg_s(self) -> Array:
        """Rates of the axes [deg/s], (3,)."""
        return self._plant.rates_rad_s / units.DEG

    async def make_safe(self) -> None:
        """Ramp down to rest and lock, during any motion. Raises `DeviceFault` where the plant has failed."""
        if self._fault:
            raise DeviceFault(self._fault)
        if self.locked:
            return
        await self._follow(RampDown(self._plant.angles_rad, self._plant.rates_rad_s, deceleration_rad_s2(self._limits)))

    async def _follow(self, profile: Profile) -> None:
        """Give the axes a profile and let time pass until they rest; a later demand takes over and stops this one."""
        self._begin(profile)
        await self._finish(profile, self._demand)

    def _begin(self, profile: Profile) -> None:
        self._demand += 1
        self._profile, self._step = profile, 0

    async def _finish(self, profile: Profile, demand: int) -> None:
        """Let time pass until a profile that may have begun some time ago is over, settle, lock."""
        done = self._step // self._plant.steps_per_tick
        moving = ceil(profile.duration_s * self._clock.rate_hz - 1e-6) - done
        waited = max(0, -moving) / self._clock.rate_hz
        longest = max(1, int(SLICE_S * self._clock.rate_hz))
        while moving > 0:
            await self._pass(min(moving, longest), demand)
            moving -= longest
        await self._settle(demand, waited)
        self._lock()

    async def _pass(self, ticks: int, demand: int) -> None:
        await self._clock.pass_ticks(ticks)
        if demand != self._demand:
            raise Stopped("the table was stopped by another demand")

    async def _settle(self, demand: int, waited: float) -> None:
        """Wait until the axes settle. `waited`: time since the end of the profile [s]."""
        ticks = max(1, int(SETTLE_SLICE_S * self._clock.rate_hz))
        longest = waited + SETTLE_TIMEOUT_S
        while waited < longest:
            await self._pass(ticks, demand)
            waited += ticks / self._clock.rate_hz
            at_rest = np.max(np.abs(self._plant.rates_rad_s)) < SETTLED_RATE_RAD_S
            if waited > SETTLE_S - 1e-9 and self._error_rad() < SETTLED_ERROR_RAD and at_rest:
                return
        raise NotSettled(f"the table did not come to rest within {SETTLE_TIMEOUT_S:g} s of its move")

    def _error_rad(self) -> float:
        """Largest distance of an axis from the end of the profile [rad]."""
        if self._profile is None:
            return 0.0
        target = self._profile.at(np.array([self._profile.duration_s + 1.0]))[0][0]
        return float(np.max(np.abs(self._plant.angles_rad - target)))

    def _lock(self) -> None:
        """Hold the axes where they are, and bring each angle to within half a turn."""
        here = self._plant.angles_rad
        turns = np.rint(here / (2.0 * np.pi))
        self._turns = np.where(self._turned, 0.0, self._turns + turns)
        self._turned[:] = False
        self._plant.put(here - 2.0 * np.pi * turns)
        self._profile = None
        self._rest = self._at_rest()

    def _at_rest(self) -> tuple[Array, Array]:
        return at_rest(self._leaning(self._plant.attitude()[None]), self._truth.site)

    def _leaning(self, rot_enu_b: Array) -> Array:
        """Attitudes (n, 3, 3) of the inner axis' end, and what the unit's are."""
        return rot_enu_b if self._lean is None else rot_enu_b @ small_turn(self._lean[None])

    def rest_truth(self) -> tuple[Array, Array]:
        """True angular rate [rad/s] and specific force [m/s²] in the unit's axes while locked, each (3,): for tests."""
        return self._rest[0][0], self._rest[1][0]

    def advance(self, ticks: int) -> Motion:
        """Advance the table by some ticks. A plant that fails leaves the table faulted."""
        tick_s = 1.0 / self._clock.rate_hz
        if self._profile is None or self._fault:
            return Motion(ticks, self._rest[0] * tick_s, self._rest[1] * tick_s)
        steps = ticks * self._plant.steps_per_tick
        try:
            path = self._plant.run(self._profile, self._step, steps)
        except DeviceFault as fault:
            self._fault = str(fault)
            raise
        self._step += steps
        if isinstance(self._profile, Sine):
            self._traced = appended(
                self._traced, self._seen(path[self._plant.steps_per_tick :: self._plant.steps_per_tick])
            )
        if isinstance(self._profile, Spin):
            self._unwind(self._profile)
        rotation = self._leaning(attitude(path, self._truth.table, self._description.site.azimuth_deg))
        angle, velocity = path_increments(rotation, self._plant.steps_per_tick, tick_s, self._truth.site)
        return Motion(ticks, angle, velocity)

    def _seen(self, joints_rad: Array) -> EncoderTrace:
        """Encoder readings of true joint angles at the ends of the ticks that pass now, (ticks, 3)."""
        shown = (joints_rad - self._pointing + 2.0 * np.pi * self._turns) / units.DEG
        times: Array = (self._clock.ticks + np.arange(1, len(shown) + 1, dtype=np.float64)) / self._clock.rate_hz
        return EncoderTrace(times, shown, np.zeros(len(shown)))

    def _unwind(self, spin: Spin) -> None:
        """Take whole turns out of a turning axis and of its setpoint: far from zero a servo never rests (rounding)."""
        turns = np.rint(self._plant.angles_rad / (2.0 * np.pi))
        if np.any(turns):
            self._turns = self._turns + turns
            self._plant.shift(-2.0 * np.pi * turns)
            self._profile = replace(spin, start_rad=spin.start_rad - 2.0 * np.pi * turns)

    def checkpoint(self) -> dict[str, Any]:
        """State to resume from. Raises `DeviceFault` while the table moves: only a locked one has a state."""
        if not self.locked:
            raise DeviceFault("a moving table has no checkpoint")
        return {
            "angles_rad": self._plant.angles_rad.tolist(),
            "integral": self._plant.integral.tolist(),
            "turns": self._turns.tolist(),
            "pointing_rad": self._pointing.tolist(),
            "moves": self._moves,
            "fault": self._fault,
            "lean_rad": None if self._lean is None else self._lean.tolist(),
        }

    def resume(self, state: dict[str, Any]) -> None:
        """Stand, locked, at the position of a checkpoint."""
        self._turns = np.array(state["turns"], dtype=np.float64)
        self._pointing = np.array(state["pointing_rad"], dtype=np.float64)
        self._moves = int(state["moves"])
        self._fault = str(state["fault"])
        self._lean = None if state["lean_rad"] is None else np.array(state["lean_rad"], dtype=np.float64)
        self._plant.put(np.array(state["angles_rad"], dtype=np.float64), np.array(state["integral"], dtype=np.float64))
        self._rest = self._at_rest()
