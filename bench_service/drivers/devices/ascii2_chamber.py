"""Driver of a chamber that speaks ASCII-2: implements `procedures.bench.chamber.Chamber`. Not confirmed on a device."""

from pydantic import Field, model_validator

from bench_service.drivers.devices.chamber_rules import (
    limits_of,
    obey_on_safe,
    require_allowed,
    require_fit,
    require_same,
)
from bench_service.drivers.devices.wire import Greeting, line_times
from bench_service.drivers.interface.driver import DeviceDriver, DriverContext, Found
from bench_service.drivers.interface.sections import NonNegative, WireChamber
from bench_service.drivers.link.exchange import Ask, Request
from bench_service.drivers.link.framing import Framing
from bench_service.drivers.link.line import DeviceLine
from bench_service.drivers.protocols import ascii2
from bench_service.drivers.protocols.ascii2 import Layout, State
from procedures.bench.chamber import ChamberLimits, ChamberReading
from procedures.bench.device import DeviceIdentity, StatusWord
from procedures.bench.errors import DeviceFault

RESOLUTION_C = 0.1


class Ascii2Section(WireChamber):
    """Section of an ASCII-2 chamber; the layout is that of its own help text (`$01?`)."""

    bus_address: int = Field(default=1, ge=0, le=99)
    analogue: int = Field(default=7, ge=1, le=32)
    digital: int = Field(default=32, ge=1, le=128)
    temperature_field: int = Field(default=0, ge=0, le=31)
    start_bit: int = Field(default=1, ge=0, le=127)
    door_bit: int | None = Field(default=None, ge=0, le=127)
    alarm_bit: int | None = Field(default=None, ge=0, le=127)
    gradients: bool = True
    """False for a machine without `$01U`: it keeps its own ramp, so a demand of a slower one is refused."""

    after_set_s: NonNegative = 1.0
    """Pause between a set and its read-back [s]."""

    @model_validator(mode="after")
    def _has_a_layout(self) -> "Ascii2Section":
        _ = self.layout
        return self

    @property
    def layout(self) -> Layout:
        """Layout of the lines that the section describes. Raises `ValueError` for a layout that contradicts itself."""
        return Layout(
            self.bus_address,
            self.analogue,
            self.digital,
            self.temperature_field,
            self.start_bit,
            self.door_bit,
            self.alarm_bit,
        )


class Ascii2Chamber:
    """Chamber over ASCII-2, whose every write sets all fields: it is read, changed in one place, and written."""

    def __init__(self, section: Ascii2Section, context: DriverContext) -> None:
        self._section, self._clock, self._layout = section, context.clock, section.layout
        self._state = Request(ascii2.read_request(self._layout), "its state", lambda a: ascii2.state(self._layout, a))
        identity = Request(self._state.data, "its state", lambda a: _identity(ascii2.state(self._layout, a)))
        self._greeting = Greeting("chamber", identity, self._first_words, context.note)
        self._line = DeviceLine(
            "chamber", section.address, Framing(ascii2.ENDING), self._greeting, line_times(section, section.after_set_s)
        )

    @property
    def limits(self) -> ChamberLimits:
        """Limits of demands: the section's, for the protocol reports none."""
        return limits_of(self._section.limits)

    async def connect(self) -> Found:
        """Make the line, read the state; see `WireDevice`."""
        reading = await self.read()
        return Found(await self.identify(), reading.status)

    async def identify(self) -> DeviceIdentity:
        """Return the shape of the chamber's state as its model: the protocol has no identity of its own."""
        return await self._line.ask(self._greeting.identity)

    async def command(self, temperature_c: float, ramp_c_min: float) -> None:
        """Set air temperature and ramp, start, and read back. Raises `OutOfRange`, `DeviceFault` for an open door or an
        alarm. Implements `Chamber.command`.
        """
        require_allowed(self.limits, temperature_c, ramp_c_min)
        state = await self._line.ask(self._state)
        require_fit(state.bit(self._layout.door), state.bit(self._layout.alarm))
        await self._lead(state, temperature_c, ramp_c_min, start=True)

    async def read(self) -> ChamberReading:
        """Return air temperature, set point (None: it stands still), door and alarm. Implements `Chamber.read`."""
        layout, state = self._layout, await self._line.ask(self._state)
        running = state.bit(layout.start)
        target = state.set_points[layout.temperature] if running else None
        names = ((layout.start, "start"), (layout.door, "door open"), (layout.alarm, "switched off"))
        bits = tuple(name for place, name in names if state.bit(place))
        return ChamberReading(
            self._clock.now_s(),
            state.actual[layout.temperature],
            None,
            target,
            state.bit(layout.door),
            state.bit(layout.alarm),
            status=(StatusWord("switches", state.digital, bits),),
        )

    async def make_safe(self) -> None:
        """Bring a running chamber into the state that `on_safe` names; one that stands still gets no demand. Implements
        `Chamber.make_safe`.
        """
        state = await self._line.ask(self._state)
        if not state.bit(self._layout.start):
            return
        switches = ascii2.with_bit(state.digital, self._layout.start, False)
        await obey_on_safe(
            self._section,
            self.limits,
            lambda: self._write(state.set_points, switches, "its end"),
            lambda temperature_c, ramp_c_min: self._lead(state, temperature_c, ramp_c_min, start=False),
        )

    def close(self) -> None:
        """Drop the line; see `WireDevice`."""
        self._line.close()

    async def _lead(self, state: State, temperature_c: float, ramp_c_min: float, start: bool) -> None:
        if self._section.gradients:
            data = ascii2.gradient_request(self._layout, ramp_c_min, ramp_c_min)
            name = f"ramps of {ramp_c_min:g} K/min"
            await self._line.ask(Request(data, name, ascii2.acknowledged, demand=True))
        elif ramp_c_min < self.limits.ramp_c_min:
            raise DeviceFault(
                f"ramp_c_min = {ramp_c_min:g}: this chamber takes no ramp (gradients = false), only its own, "
                f"{self.limits.ramp_c_min:g}"
            )
        points = list(state.set_points)
        points[self._layout.temperature] = temperature_c
        switches = ascii2.with_bit(state.digital, self._layout.start, True) if start else state.digital
        found = await self._write(points, switches, f"a set point of {temperature_c:g} °C")
        require_same(
            "a set point of", temperature_c, found.set_points[self._layout.temperature], 0.5 * RESOLUTION_C + 1e-6
        )

    async def _write(self, points: list[float] | tuple[float, ...], switches: str, name: str) -> State:
        data = ascii2.write_request(self._layout, points, switches)
        await self._line.ask(Request(data, name, ascii2.acknowledged, demand=True))
        found = await self._line.ask(self._state)
        if found.digital[: self._layout.digital] != switches[: self._layout.digital]:
            raise DeviceFault(f"the chamber was given {name} and its switches read back as {found.digital}")
        return found

    def _first_words(self, ask: Ask) -> None:
        ask(self._state)


def _identity(state: State) -> DeviceIdentity:
    return DeviceIdentity(model=f"ASCII-2 chamber of {len(state.actual)} channels and {len(state.digital)} switches")


DRIVER = DeviceDriver("chamber", "ascii2", Ascii2Section, Ascii2Chamber)
