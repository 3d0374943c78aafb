"""Mixed bench: real devices beside simulated ones, on one clock, the wall's.

The simulated world follows that clock: before each verb to one of its devices it is moved to the present moment, and
where a verb waits the world keeps pace. A simulated unit on a real table feels what the table did: a simulated table
below it repeats the motion, standing where the encoders of the real one show. In the same way its power follows the
real supply.
"""

from collections.abc import Mapping
from typing import Any, Protocol

from procedures.bench.device import DeviceIdentity
from procedures.bench.supply import SupplyLimits, SupplyReading
from procedures.bench.turntable import EncoderTrace, TableReading
from procedures.core.constant_rate import ConstantRate
from procedures.core.sinusoid import Sinusoid
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn


class FollowingClock(Protocol):
    """Clock of a simulated world that follows another one. Interface."""

    def catch_up(self) -> None:
        """Compute the world up to the present moment of the clock that it follows."""
        ...

    def now_s(self) -> float:
        """Return the bench time of the simulated world [s]."""
        ...

    async def sleep(self, seconds: float) -> None:
        """Let the world continue, keeping pace with the clock that it follows."""
        ...


class CatchUp:
    """Observer of a mixed bench that computes the simulated world up to the present before each verb."""

    def __init__(self, world: FollowingClock) -> None:
        self._world = world

    def begin(self, verb: str, arguments: Mapping[str, Any]) -> None:
        self._world.catch_up()

    def end(self, verb: str, failure: BaseException | None) -> None:
        return

    def asked(self, device: str) -> None:
        return

    def heard(self, device: str) -> None:
        return


class MixedClock:
    """Implements `procedures.bench.clock.Clock` by real time; the world continues while it sleeps."""

    def __init__(self, wall: Any, world: FollowingClock) -> None:
        self._wall = wall
        self._world = world

    def now_s(self) -> float:
        return self._wall.now_s()

    async def sleep(self, seconds: float) -> None:
        until_s = self._wall.now_s() + seconds
        await self._world.sleep(max(0.0, until_s - self._world.now_s()))


class TwinTurntable:
    """A real table, whose motion a simulated one repeats, which carries the simulated unit."""

    def __init__(self, real: Any, below: Any) -> None:
        self._real, self._below = real, below

    async def identify(self) -> DeviceIdentity:
        return await self._real.identify()

    async def move_to(self, angles: TableAngles) -> None:
        await self._real.move_to(angles)
        shown = (await self._real.read()).angles
        self._below.place(shown, (0.0, 0.0, 0.0))

    async def command_turn(self, turn: Turn) -> None:
        await self._real.command_turn(turn)
        await self._below.command_turn(turn)

    async def command_rate(self, rate: ConstantRate) -> None:
        await self._real.command_rate(rate)
        await self._below.command_rate(rate)

    async def command_sinusoid(self, sinusoid: Sinusoid) -> None:
        await self._real.command_sinusoid(sinusoid)
        await self._below.command_sinusoid(sinusoid)

    def trace(self) -> EncoderTrace:
        return self._real.trace()

    async def settle(self) -> None:
        await self._real.settle()
        await self._below.settle()

    async def read(self) -> TableReading:
        return await self._real.read()

    async def make_safe(self) -> None:
        try:
            await self._real.make_safe()
        finally:
            await self._below.make_safe()


class TwinSupply:
    """A real supply whose switching is repeated to a simulated unit."""

    def __init__(self, real: Any, below: Any) -> None:
        self._real, self._below = real, below

    @property
    def limits(self) -> SupplyLimits:
        return self._real.limits

    async def identify(self) -> DeviceIdentity:
        return await self._real.identify()

    async def set_output(self, voltage_v: float, current_a: float) -> None:
        await self._real.set_output(voltage_v, current_a)

    async def switch_on(self) -> None:
        await self._real.switch_on()
        await self._below.switch_on()

    async def switch_off(self) -> None:
        try:
            await self._real.switch_off()
        finally:
            await self._below.switch_off()

    async def read(self) -> SupplyReading:
        return await self._real.read()

    async def make_safe(self) -> None:
        try:
            await self._real.make_safe()
        finally:
            await self._below.make_safe()
