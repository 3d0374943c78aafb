"""Driver of a three-axis table with an ACUTROL controller: implements `procedures.bench.turntable.Turntable`.

Not confirmed on a device. Limits go out before a demand, a demand before its mode; the servo holds the axes at rest.
"""

import asyncio
from collections.abc import Callable
from math import sqrt

from bench_service.drivers.devices.acutrol_link import AcutrolSection, is_mode
from bench_service.drivers.devices.acutrol_swing import SwingingTable
from bench_service.drivers.devices.acutrol_watch import POLL_S, STOPPED
from bench_service.drivers.devices.table_axes import AXES, TurnProgress, angles_of, declared, steps, wrapped
from bench_service.drivers.interface.driver import DeviceDriver, Found, narrowed
from procedures.bench.description import BenchDescription
from procedures.bench.device import DeviceIdentity
from procedures.bench.errors import DeviceFault, NotSettled, Stopped
from procedures.bench.turntable import TableReading
from procedures.core.constant_rate import ConstantRate
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn

MOST_LEFT_DEG = 170.0
"""Largest angle between the stop of turns and their end: beyond it the shorter way would be another number of turns."""
LEAVE_S = 0.5
"""Time that a motion which is followed may take to be left [s, real time]."""


class AcutrolTurntable(SwingingTable):
    """Three-axis table on an ACUTROL controller, whose every motion is watched by its encoders. A cancelled motion
    continues to its end by itself.
    """

    async def connect(self) -> Found:
        """Make the line, identify, read status and factory limits; see `WireDevice`."""
        identity = await self.identify()
        await self._states()
        return Found(identity, await self._link.status(), self._link.own)

    async def identify(self) -> DeviceIdentity:
        """Ask for maker, model, serial and firmware, and return them."""
        return await self._link.identify()

    async def read(self) -> TableReading:
        """Return encoder angles and rates, whether the table moves, and status words. Implements `Turntable.read`."""
        states, status = await self._states(), await self._link.status()
        moving = self._under_way() or any(abs(s.rate_deg_s) > self._section.rest_rate_deg_s for s in states)
        outer, middle, inner = (s.rate_deg_s for s in states)
        angles = angles_of([s.position_deg for s in states])
        return TableReading(self._clock.now_s(), angles, moving, status, rates_deg_s=(outer, middle, inner))

    async def move_to(self, angles: TableAngles) -> None:
        """Move all axes and wait until they have settled. Raises `OutOfRange` before anything moves, `NotSettled`,
        `DeviceFault`. Implements `Turntable.move_to`.
        """
        self._require_allowed(declared(self._section).violations(angles))
        demand = self._begin()
        try:
            start = await self._require_ready()
            self._require_allowed(declared(narrowed(self._section, self._link.own)).violations(angles))
            end = [angles.outer_deg, angles.middle_deg, angles.inner_deg]
            positions = [state.position_deg for state in start]
            for step in steps(positions, end, [count.counts for count in self._counts]):
                await self._go(positions, step, demand)
                positions = step
        finally:
            self._end(demand)

    async def command_turn(self, turn: Turn) -> None:
        """Begin whole turns of one axis and return; they are followed from here on, while time passes elsewhere.
        Implements `Turntable.command_turn`.
        """
        index, demand = AXES.index(turn.axis), self._begin()
        rate = turn.rate_deg_s if turn.turns > 0 else -turn.rate_deg_s
        start = await self._begin_rate(
            index, rate, turn.ramp_s, demand, lambda bench, here: bench.violations(here, turn)
        )
        self._turning = asyncio.create_task(self._follow(turn, index, start, demand))

    async def command_rate(self, rate: ConstantRate) -> None:
        """Begin a constant rate of one axis and return; it is watched and ended from here on. Implements
        `Turntable.command_rate`.
        """
        index, demand = AXES.index(rate.axis), self._begin()
        start = await self._begin_rate(
            index, rate.rate_deg_s, rate.ramp_s, demand, lambda bench, here: bench.rate_violations(here, rate)
        )
        self._turning = asyncio.create_task(self._follow_rate(rate, index, start, demand))

    async def _begin_rate(
        self,
        index: int,
        rate_deg_s: float,
        ramp_s: float,
        demand: int,
        violations: Callable[[BenchDescription, TableAngles], tuple[str, ...]],
    ) -> list[float]:
        """Begin a rate of an axis within limits, from rest; the angles where the axes stood. Ends the demand if not."""
        try:
            states = await self._require_ready()
            here = [state.position_deg for state in states]
            self._require_allowed(violations(declared(narrowed(self._section, self._link.own)), angles_of(here)))
            await self._prepare_brake(demand)
            self._can_brake = False
            await self._link.limit("rate", index, abs(rate_deg_s), abs(rate_deg_s) / ramp_s)
            self._require_current(demand)
            await self._link.demand("rate", index, rate_deg_s)
            self._require_current(demand)
            await self._link.mode("rate", [index])
            return here
        except BaseException:
            self._end(demand)
            raise

    async def settle(self) -> None:
        """Wait for the end of the commanded motion. Raises `NotSettled`, and `Stopped` where it was stopped. Implements
        `Turntable.settle`.
        """
        if (turning := self._turning) is not None:
            await asyncio.wait([turning])
            if self._turning is turning:
                self._turning = None
            if turning.cancelled():
                raise Stopped(STOPPED)
            turning.result()
        elif not await self._rests():
            raise NotSettled("the table moves although this service commanded no motion")

    async def make_safe(self) -> None:
        """Ramp down to rest and hold, or with the servo off as `on_safe` says, and wait until that is read back.
        Implements `Turntable.make_safe`.
        """
        self._demand += 1
        self._busy = False
        if (turning := self._turning) is not None:
            turning.cancel()
            await asyncio.wait([turning], timeout=LEAVE_S)  # its last statement, which brakes, before those from here
        if await self._rests() and not await self._begins_to_move():
            return
        longest = max(axis.rate_deg_s / axis.acceleration_deg_s2 for axis in self._axes())
        braked: list[int] = []
        try:
            await self._brake(braked)
        except DeviceFault:  # an open interlock refuses, and brakes by itself: rest is what counts
            await self._wait_for_rest(None, longest, self._demand)
            return
        await self._wait_for_rest(None, longest, self._demand)
        if self._section.on_safe == "off":
            await self._link.mode("off")
            return
        for index, state in enumerate(await self._link.states()):
            if index in braked or await self._link.mode_of(index) != "position":  # an axis that holds keeps holding
                await self._link.demand("position", index, state.position_deg)
                await self._link.mode("position", [index])

    async def _brake(self, braked: list[int]) -> None:
        """Take the rate away from each axis that moves, the fastest one first, and note it as `braked`."""
        states = await self._link.states()
        moving = [k for k, state in enumerate(states) if abs(state.rate_deg_s) > self._section.rest_rate_deg_s]
        for index in sorted(moving, key=lambda k: -abs(states[k].rate_deg_s)):
            braked.append(index)
            await self._stop_at_rate(index)
        for index in range(len(states)):  # one that swings stands still where it turns, and where it begins
            if index not in braked and _moves_on(await self._link.mode_of(index)):
                braked.append(index)
                await self._stop_at_rate(index)

    async def _begins_to_move(self) -> bool:
        """True if an axis is in a mode that moves it: a slow motion looks like rest for seconds after its begin."""
        for index in range(len(AXES)):
            if _moves_on(await self._link.mode_of(index)):
                return True
        return False

    def close(self) -> None:
        """Drop the line; see `WireDevice`."""
        self._link.close()

    def restore(self, angles: TableAngles) -> None:
        """Take over the unwrapped angles that were remembered, before the first reading of an encoder of one turn."""
        for count, angle in zip(self._counts, (angles.outer_deg, angles.middle_deg, angles.inner_deg), strict=True):
            count.restore(angle)

    async def _go(self, start: list[float], end: list[float], demand: int) -> None:
        """Set limits, then demands, then the mode; wait until the axes rest where they were asked."""
        longest = 0.0
        await self._prepare_brake(demand)
        for index, axis in enumerate(self._axes()):
            self._require_current(demand)
            await self._link.limit("position", index, axis.rate_deg_s, axis.acceleration_deg_s2)
            distance = abs(end[index] - start[index])
            longest = max(longest, _duration_s(distance, axis.rate_deg_s, axis.acceleration_deg_s2))
        for index, count in enumerate(self._counts):
            self._require_current(demand)
            await self._link.demand("position", index, wrapped(end[index]) if count.counts else end[index])
        self._require_current(demand)
        try:
            await self._link.mode("position")
        except DeviceFault:
            await self._link.require_closed()  # one that opens between two axes refuses the second: said by its name
            raise
        await self._wait_for_rest(end, longest, demand)

    async def _follow(self, turn: Turn, index: int, start: list[float], demand: int) -> None:
        """Count the turns of an axis in rate mode, stop it before their end, and lead it to the angle of the start."""
        async with self._followed(index, demand):
            sign = 1.0 if turn.turns > 0 else -1.0
            progress = TurnProgress(start[index], sign * turn.rate_deg_s, self._clock.now_s())
            stopped = await self._stop_after(progress, index, turn.angle_deg, turn.ramp_s, demand)
            await self._wait_for_rest(None, turn.ramp_s, demand)
            rested = self._clock.now_s()
            not_turned = progress.rate_deg_s * (rested - stopped - 0.5 * turn.ramp_s)
            states = await self._states()
            progress.read(states[index].position_deg, rested, not_turned)
            await self._return(turn, index, start, turn.angle_deg - progress.turned_deg, demand)

    async def _follow_rate(self, rate: ConstantRate, index: int, start: list[float], demand: int) -> None:
        """End a rate once its angle is covered, and hold the axis where it comes to rest."""
        async with self._followed(index, demand):
            progress = TurnProgress(start[index], rate.rate_deg_s, self._clock.now_s())
            await self._stop_after(progress, index, rate.angle_deg, rate.ramp_s, demand)
            await self._wait_for_rest(None, rate.ramp_s, demand)
            self._require_current(demand)
            await self._link.demand("position", index, (await self._link.states())[index].position_deg)
            await self._link.mode("position", [index])

    async def _stop_after(
        self, progress: TurnProgress, index: int, angle_deg: float, ramp_s: float, demand: int
    ) -> float:
        """Take the rate away so that the axis rests once it has covered an angle; the bench time of that [s]."""
        rate, sign = abs(progress.rate_deg_s), 1.0 if angle_deg > 0.0 else -1.0
        until_stop = abs(angle_deg) - 0.5 * rate * ramp_s
        while True:
            states, now = await self._link.states(), self._clock.now_s()
            left_s = (until_stop - sign * progress.read(states[index].position_deg, now)) / rate
            if left_s <= POLL_S:
                break
            await self._clock.sleep(min(POLL_S, left_s))
        await self._clock.sleep(max(0.0, left_s))
        self._require_current(demand)
        await self._link.demand("rate", index, 0.0)
        return self._clock.now_s()

    async def _return(self, turn: Turn, index: int, start: list[float], left_deg: float, demand: int) -> None:
        """Lead the axis that has turned by what is left of its turns, the others compared with where they stood."""
        axis, here = self._axes()[index], (await self._states())[index].position_deg
        if abs(left_deg) > MOST_LEFT_DEG:
            raise DeviceFault(f"the {turn.axis} axis stopped {left_deg:g} deg before the end of its turns")
        ends = [here + left_deg if k == index else angle for k, angle in enumerate(start)]
        longest = _duration_s(abs(left_deg), axis.rate_deg_s, axis.acceleration_deg_s2)
        await self._lead(index, here, ends, longest, demand)


def _moves_on(mode: str) -> bool:
    """True for a mode in which an axis moves until the mode or the demand changes; in the others it comes to rest."""
    return is_mode(mode, "synthesis") or is_mode(mode, "rate")


def _duration_s(distance_deg: float, rate_deg_s: float, acceleration_deg_s2: float) -> float:
    """Time from rest to rest over a distance within rate and acceleration [s]."""
    if distance_deg * acceleration_deg_s2 < rate_deg_s**2:
        return 2.0 * sqrt(distance_deg / acceleration_deg_s2)
    return distance_deg / rate_deg_s + rate_deg_s / acceleration_deg_s2


DRIVER = DeviceDriver("turntable", "acutrol", AcutrolSection, AcutrolTurntable)
