"""Driver of a chamber that speaks SIMSERV: implements `procedures.bench.chamber.Chamber`."""

from collections.abc import Callable
from typing import TypeVar

from pydantic import Field

from bench_service.drivers.devices.chamber_rules import (
    limits_of,
    obey_on_safe,
    require_allowed,
    require_fit,
    require_same,
)
from bench_service.drivers.devices.wire import Greeting, accepted, line_times
from bench_service.drivers.interface.driver import Bound, DeviceDriver, DriverContext, Found
from bench_service.drivers.interface.sections import NonNegative, Positive, WireChamber
from bench_service.drivers.link.exchange import Ask, Request
from bench_service.drivers.link.framing import Framing
from bench_service.drivers.link.line import DeviceLine
from bench_service.drivers.protocols import simserv
from bench_service.drivers.protocols.simserv import ChamberStatus, Command, Information
from procedures.bench.chamber import ChamberLimits, ChamberReading
from procedures.bench.device import DeviceIdentity, Status, StatusWord
from procedures.bench.errors import DeviceFault

T = TypeVar("T")
RUN = "1"
"""Index of the start switch among the digital outputs."""
MOST_INPUTS = 64


class SimservSection(WireChamber):
    """Section of a SIMSERV chamber."""

    variable: int = Field(default=1, ge=1, le=9)
    """Index of the temperature among the control variables."""
    door_input: str = Field(default="", max_length=64)
    """Name of the digital input that is 1 while the door is open, as the controller names it; empty: none."""
    after_set_s: NonNegative = 1.0
    """Pause between a set and its read-back [s]."""
    readback_c: Positive = 0.051
    """Largest difference of a set point read back [°C]."""


class SimservChamber:
    """Chamber over SIMSERV, whose set point is the final one: the controller makes the ramp by its gradients."""

    def __init__(self, section: SimservSection, context: DriverContext) -> None:
        self._section, self._clock = section, context.clock
        self._variable = str(section.variable)
        self._own: tuple[Bound, ...] = ()
        self._door: int | None = None
        self._first = Request(
            simserv.request(Command.INFORMATION, [str(Information.TYPE.value)]), "its type", simserv.text_of
        )
        identity = Request(self._first.data, "its type", lambda answer: DeviceIdentity(model=simserv.text_of(answer)))
        self._greeting = Greeting("chamber", identity, self._first_words, context.note)
        self._line = DeviceLine(
            "chamber",
            section.address,
            Framing(simserv.REPLY_ENDING),
            self._greeting,
            line_times(section, section.after_set_s),
        )

    @property
    def limits(self) -> ChamberLimits:
        """Limits of demands; the chamber's own are among them once a line was made."""
        return limits_of(self._section.limits, self._own)

    async def connect(self) -> Found:
        """Make the line, identify, read status and limits; see `WireDevice`."""
        reading = await self.read()
        return Found(await self.identify(), reading.status, self._own)

    async def identify(self) -> DeviceIdentity:
        """Ask for type, serial and software version, and return them."""
        model = await self._ask(Command.INFORMATION, [str(Information.TYPE.value)], simserv.text_of)
        serial = await self._ask(Command.INFORMATION, [str(Information.SERIAL.value)], simserv.text_of)
        return DeviceIdentity("", model, serial)

    async def command(self, temperature_c: float, ramp_c_min: float) -> None:
        """Set gradients, then the set point, then start, and read each back. Raises `OutOfRange`, `DeviceFault`.
        Implements `Chamber.command`.
        """
        require_allowed(limits_of(self._section.limits), temperature_c, ramp_c_min)
        status = await self._status()  # greets, and so reads the chamber's own limits
        require_allowed(self.limits, temperature_c, ramp_c_min)
        require_fit(await self._door_open(), bool(status & ChamberStatus.ALARM), await self._message(status))
        await self._lead(temperature_c, ramp_c_min)
        if not status & ChamberStatus.RUNNING:
            await self._run(True)

    async def read(self) -> ChamberReading:
        """Return air temperature, set point (None: it stands still), door and alarm. Implements `Chamber.read`."""
        status = await self._status()
        air = await self._ask(Command.ACTUAL, [self._variable], simserv.number_of)
        target = await self._ask(Command.GET_SET_POINT, [self._variable], simserv.number_of)
        running = bool(status & ChamberStatus.RUNNING)
        bits = tuple(flag.name.lower() for flag in ChamberStatus if flag.name and flag in status)
        words: Status = (StatusWord("10012", str(int(status)), bits),)
        if message := await self._message(status):
            words += (StatusWord("message", message),)
        tripped = bool(status & ChamberStatus.ALARM)
        return ChamberReading(
            self._clock.now_s(), air, None, target if running else None, await self._door_open(), tripped, status=words
        )

    async def make_safe(self) -> None:
        """Bring a running chamber into the state that `on_safe` names; one that stands still gets no demand. Implements
        `Chamber.make_safe`.
        """
        status = await self._status()
        if status & ChamberStatus.RUNNING:
            await obey_on_safe(self._section, self.limits, lambda: self._run(False), self._lead)

    def close(self) -> None:
        """Drop the line; see `WireDevice`."""
        self._line.close()

    async def _lead(self, temperature_c: float, ramp_c_min: float) -> None:
        """Set both gradients and the set point, and read all three back."""
        gradients = (
            (Command.SET_GRADIENT_UP, Command.GET_GRADIENT_UP, "a gradient up of"),
            (Command.SET_GRADIENT_DOWN, Command.GET_GRADIENT_DOWN, "a gradient down of"),
        )
        for setting, getting, name in gradients:
            await self._set(setting, [self._variable, simserv.number(ramp_c_min)], f"{name} {ramp_c_min:g} K/min")
            found = await self._ask(getting, [self._variable], simserv.number_of)
            require_same(name, ramp_c_min, found, 0.051)
        arguments = [self._variable, simserv.number(temperature_c)]
        await self._set(Command.SET_POINT, arguments, f"a set point of {temperature_c:g} °C")
        found = await self._ask(Command.GET_SET_POINT, [self._variable], simserv.number_of)
        require_same("a set point of", temperature_c, found, self._section.readback_c)

    async def _run(self, on: bool) -> None:
        name = "its start" if on else "its end"
        await self._set(Command.SET_DIGITAL, [RUN, str(int(on))], name)
        if bool(await self._ask(Command.GET_DIGITAL, [RUN], simserv.whole_of)) != on:
            raise DeviceFault(f"the chamber was given {name} and its read-back does not confirm it")

    async def _status(self) -> ChamberStatus:
        return await self._ask(Command.STATUS, [], simserv.status_of)

    async def _door_open(self) -> bool:
        if not self._section.door_input:
            return False
        if self._door is None:
            raise DeviceFault(f"the chamber has no digital input {self._section.door_input!r}: its door cannot be read")
        return bool(await self._ask(Command.DIGITAL_INPUT, [str(self._door)], simserv.whole_of))

    async def _message(self, status: ChamberStatus) -> str:
        """First message of a chamber in alarm or with a warning; empty: there is none."""
        if not status & (ChamberStatus.ALARM | ChamberStatus.WARNING):
            return ""
        if await self._ask(Command.MESSAGE_COUNT, [], simserv.whole_of) == 0:
            return ""
        return await self._ask(Command.MESSAGE_TEXT, ["1"], simserv.text_of)

    async def _ask(self, command: Command, arguments: list[str], read: Callable[[bytes], T]) -> T:
        name = f"{command.name.lower().replace('_', ' ')} ({command.value})"
        return await accepted(self._line.ask(Request(simserv.request(command, arguments), name, read)), "chamber", name)

    async def _set(self, command: Command, arguments: list[str], name: str) -> None:
        request = Request(simserv.request(command, arguments), name, simserv.accepted, demand=True)
        await accepted(self._line.ask(request), "chamber", name)

    def _first_words(self, ask: Ask) -> None:
        """Status, own limits and the place of the door, at each new line."""

        def put(command: Command, *arguments: str) -> float:
            return ask(Request(simserv.request(command, arguments), command.name.lower(), simserv.number_of))

        ask(Request(simserv.request(Command.STATUS), "its status", simserv.status_of))
        self._own = (
            Bound("limits.minimum_c", put(Command.INPUT_MINIMUM, self._variable)),
            Bound("limits.maximum_c", put(Command.INPUT_MAXIMUM, self._variable)),
        )
        self._door = None
        if self._section.door_input:
            for index in range(1, min(MOST_INPUTS, int(put(Command.DIGITAL_INPUT_COUNT))) + 1):
                data = simserv.request(Command.DIGITAL_INPUT_NAME, [str(index)])
                if ask(Request(data, "an input's name", simserv.text_of)) == self._section.door_input:
                    self._door = index


DRIVER = DeviceDriver("chamber", "simserv", SimservSection, SimservChamber)
