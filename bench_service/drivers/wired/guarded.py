"""Devices that are read back by the bench itself, whatever their driver does: safe only when they read as safe."""

from typing import Any

from bench_service.drivers.interface.driver import Kind
from bench_service.drivers.interface.sections import DeviceSection
from bench_service.drivers.wired.read_back import unsafe_reading
from procedures.bench.errors import DeviceFault
from procedures.core.sinusoid import Sinusoid
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn


class Guarded:
    """A device whose `make_safe` ends with a reading; every other verb is the device's own."""

    def __init__(self, kind: Kind, section: DeviceSection, device: Any) -> None:
        self._kind = kind
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

    async def command_sinusoid(self, sinusoid: Sinusoid) -> None:
        await self._need_home()
        await self._device.command_sinusoid(sinusoid)

    async def _need_home(self) -> None:
        if not (await self._device.read()).homed:
            raise DeviceFault("the turntable is not homed: nothing moves until a person has homed it at its controller")
