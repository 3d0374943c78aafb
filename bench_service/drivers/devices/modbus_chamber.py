"""Driver of a chamber with a Modbus register map in the bench file: implements `procedures.bench.chamber.Chamber`."""

from pydantic import model_validator

from bench_service.drivers.devices.chamber_rules import (
    limits_of,
    obey_on_safe,
    require_allowed,
    require_fit,
    require_same,
)
from bench_service.drivers.interface.driver import DeviceDriver, DriverContext, Found
from bench_service.drivers.interface.sections import Positive, WireChamber
from bench_service.drivers.link.modbus_line import ModbusLine
from bench_service.drivers.protocols.modbus_map import ChamberMap
from procedures.bench.chamber import ChamberLimits, ChamberReading
from procedures.bench.device import DeviceIdentity, StatusWord
from procedures.bench.errors import DeviceFault


class ModbusSection(WireChamber):
    """Section of a Modbus chamber."""

    registers: ChamberMap
    readback_c: Positive = 0.051
    """Largest difference of a set point read back [°C]."""

    @model_validator(mode="after")
    def _refuses_udp(self) -> "ModbusSection":
        if self.address.scheme == "udp":
            raise ValueError(f"address {self.address}: a Modbus device needs tcp or serial")
        return self


class ModbusChamber:
    """Chamber over Modbus, of which only the register map in the bench file is known."""

    def __init__(self, section: ModbusSection, context: DriverContext) -> None:
        self._section, self._clock, self._map = section, context.clock, section.registers
        self._line = ModbusLine(
            "chamber", section.address, self._map.unit, self._map.framing, section.connect_s, section.answer_s
        )

    @property
    def limits(self) -> ChamberLimits:
        """Limits of demands: the section's; a register map declares none."""
        return limits_of(self._section.limits)

    async def connect(self) -> Found:
        """Make the line and read all that the map has; see `WireDevice`."""
        reading = await self.read()
        return Found(await self.identify(), reading.status)

    async def identify(self) -> DeviceIdentity:
        """Return an identity with the model "Modbus chamber" only, for a register map has no maker or serial. Reads the
        air temperature, so a chamber that does not answer raises.
        """
        await self._line.read(self._map.actual)
        return DeviceIdentity(model="Modbus chamber")

    async def command(self, temperature_c: float, ramp_c_min: float) -> None:
        """Set ramp, then set point, then start, and read each back. Raises `OutOfRange`, `DeviceFault`. Implements
        `Chamber.command`.
        """
        require_allowed(self.limits, temperature_c, ramp_c_min)
        if self._map.ramp is None and ramp_c_min < self._map.own_ramp_c_min:
            raise DeviceFault(
                f"ramp_c_min = {ramp_c_min:g}: this chamber keeps its own ramp of {self._map.own_ramp_c_min:g} K/min"
            )
        reading = await self.read()
        require_fit(reading.door_open, reading.tripped)
        await self._lead(temperature_c, ramp_c_min)
        if reading.target_c is None:
            await self._run(True)

    async def read(self) -> ChamberReading:
        """Return air temperature, set point (None: it stands still), door and alarm. Implements `Chamber.read`."""
        air, target = await self._line.read(self._map.actual), await self._line.read(self._map.set_point)
        running = await self._line.read_bit(self._map.running)
        door = self._map.door is not None and await self._line.read_bit(self._map.door)
        alarm = self._map.alarm is not None and await self._line.read_bit(self._map.alarm)
        bits = tuple(name for name, on in (("running", running), ("door open", door), ("switched off", alarm)) if on)
        status = (StatusWord("bits", "".join(str(int(on)) for on in (running, door, alarm)), bits),)
        return ChamberReading(self._clock.now_s(), air, None, target if running else None, door, alarm, status=status)

    async def make_safe(self) -> None:
        """Bring a running chamber into the state that `on_safe` names; one that stands still gets no demand. Implements
        `Chamber.make_safe`.
        """
        if await self._line.read_bit(self._map.running):
            await obey_on_safe(self._section, self.limits, lambda: self._run(False), self._lead)

    def close(self) -> None:
        """Drop the line; see `WireDevice`."""
        self._line.close()

    async def _lead(self, temperature_c: float, ramp_c_min: float) -> None:
        if self._map.ramp is not None:
            await self._line.write(self._map.ramp, ramp_c_min)
            require_same("a ramp of", ramp_c_min, await self._line.read(self._map.ramp), 0.051)
        await self._line.write(self._map.set_point, temperature_c)
        found = await self._line.read(self._map.set_point)
        require_same("a set point of", temperature_c, found, self._section.readback_c)

    async def _run(self, on: bool) -> None:
        await self._line.write_bit(self._map.running, on)
        if await self._line.read_bit(self._map.running) != on:
            raise DeviceFault(f"the chamber was switched {'on' if on else 'off'} and its read-back does not confirm it")


DRIVER = DeviceDriver("chamber", "modbus", ModbusSection, ModbusChamber)
