"""Devices that are read back by the bench itself, whatever their driver does: safe only when they read as safe."""

from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

from bench_service.drivers.interface.driver import Kind
from bench_service.drivers.interface.sections import DeviceSection
from bench_service.drivers.wired.read_back import unsafe_reading
from procedures.bench.errors import DeviceFault
from procedures.bench.imu import Stream
from procedures.core.constant_rate import ConstantRate
from procedures.core.recording import Station
from procedures.core.sinusoid import Sinusoid
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn


class Guarded:
    """A device whose `make_safe` ends with a reading; every other verb is the device's own."""

    def __init__(self, kind: Kind, section: DeviceSection, device: Any) -> None:
        self._kind: Kind = kind
        self._section = section
        self._device = device

    def __getattr__(self, name: str) -> Any:
        return getattr(self._device, name)

    async def make_safe(self) -> None:
        """Make the device safe, and read it back. Raises `DeviceFault` where it does not read as safe."""
        await self._device.make_safe()
        if why := unsafe_reading(self._kind, self._section, await self._device.read()):
            raise DeviceFault(why)


class GuardedTurntable(Guarded):
    """A table that moves only if its encoders know their zero."""

    async def move_to(self, angles: TableAngles) -> None:
        await self._need_home()
        await self._device.move_to(angles)

    async def command_turn(self, turn: Turn) -> None:
        await self._need_home()
        await self._device.command_turn(turn)

    async def command_rate(self, rate: ConstantRate) -> None:
        await self._need_home()
        await self._device.command_rate(rate)

    async def command_sinusoid(self, sinusoid: Sinusoid) -> None:
        await self._need_home()
        await self._device.command_sinusoid(sinusoid)

    async def _need_home(self) -> None:
        if not (await self._device.read()).homed:
            raise DeviceFault("the turntable is not homed: nothing moves until a person has homed it at its controller")


class LaunchingSupply:
    """A supply that records when the unit was switched on, and waits for its valid data; every other verb is its
    own.
    """

    def __init__(self, supply: Any, now_s: Callable[[], float], ready: Callable[[], Awaitable[None]]) -> None:
        """Set up; `ready`: waits until the unit says that its data are valid, within a bound; raises nothing."""
        self._supply = supply
        self._now_s, self._ready = now_s, ready
        self.launched_s: float | None = None
        """Bench time at which the unit was switched on [s]; None while it is off, or where it was on before."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._supply, name)

    async def switch_on(self) -> None:
        before = await self._supply.read()
        await self._supply.switch_on()
        if not before.on:
            self.launched_s = self._now_s()
            await self._ready()

    async def switch_off(self) -> None:
        self.launched_s = None
        await self._supply.switch_off()

    async def make_safe(self) -> None:
        self.launched_s = None
        await self._supply.make_safe()


class LaunchedUnit:
    """A unit's link whose recordings say when the unit was switched on; every other verb is its own."""

    def __init__(self, unit: Any, supply: LaunchingSupply) -> None:
        self._unit = unit
        self._supply = supply

    def __getattr__(self, name: str) -> Any:
        return getattr(self._unit, name)

    def record(self, duration_s: float, station: Station | None = None) -> Stream:
        stream: Stream = self._unit.record(duration_s, station)
        return stream if stream.launched_s is not None else replace(stream, launched_s=self._supply.launched_s)


def ready_of(unit: Any) -> Callable[[], Awaitable[None]]:
    """The unit's link's wait for valid data; one that returns at once for a driver without it."""
    return getattr(unit, "ready", _at_once)


async def _at_once() -> None:
    return
