"""Driver of a SCPI power supply: implements `procedures.bench.supply.Supply`."""

from collections.abc import Callable
from typing import Annotated, TypeVar

from pydantic import Field

from bench_service.drivers.answers import Refusal
from bench_service.drivers.devices.wire import Greeting, accepted, line_times
from bench_service.drivers.interface.driver import DeviceDriver, DriverContext, Found
from bench_service.drivers.interface.sections import Positive, WireSupply
from bench_service.drivers.link.exchange import Ask, Request
from bench_service.drivers.link.framing import Framing
from bench_service.drivers.link.line import DeviceLine
from bench_service.drivers.protocols import scpi
from procedures.bench.device import DeviceIdentity, Status, StatusWord
from procedures.bench.errors import DeviceFault, OutOfRange
from procedures.bench.supply import SupplyLimits, SupplyReading

T = TypeVar("T")
MOST_ERRORS = 32
"""Number of old errors that are read away at a new line."""
Header = Annotated[str, Field(max_length=40, pattern=r"^[A-Za-z:*?]*$")]


class ScpiSection(WireSupply):
    """Section of a SCPI supply."""

    channel: int | None = Field(default=None, ge=1, le=9)
    """Number of the output; none: the supply has one output, without a number."""
    trip_query: Header = "OUTP:PROT:TRIP?"
    mode_query: Header = "OUTP:MODE?"
    readback_v: Positive = 0.02
    """Largest difference of a setting read back from its demand [V]."""
    readback_a: Positive = 0.02
    """Largest difference of a current limit read back from its demand [A]."""


class ScpiSupply:
    """Power supply over SCPI, which is asked for its errors after every set, and whose settings are read back."""

    def __init__(self, section: ScpiSection, context: DriverContext) -> None:
        self._section, self._clock = section, context.clock
        self._dialect = scpi.Dialect(section.channel, section.trip_query, section.mode_query)
        identity = Request(scpi.line(self._dialect, scpi.IDENTITY_QUERY), "its identity", _identity)
        self._greeting = Greeting("supply", identity, self._empty_errors, context.note)
        self._line = DeviceLine(
            "supply", section.address, Framing(self._dialect.ending), self._greeting, line_times(section)
        )
        bounds = section.limits
        self.limits = SupplyLimits(
            bounds.minimum_v, bounds.maximum_v, bounds.maximum_a, bounds.nominal_v, bounds.nominal_a
        )
        self._wanted: tuple[float, float] | None = None

    async def connect(self) -> Found:
        """Make the line, identify, read the state; see `WireDevice`."""
        reading = await self.read()
        return Found(await self.identify(), reading.status)

    async def identify(self) -> DeviceIdentity:
        """Ask for maker, model, serial and firmware, and return them."""
        return await self._line.ask(self._greeting.identity)

    async def set_output(self, voltage_v: float, current_a: float) -> None:
        """Set voltage and current limit, and read them back; the lower setting of the current comes first. Raises
        `OutOfRange`, `DeviceFault`. Implements `Supply.set_output`.
        """
        if violations := self.limits.violations(voltage_v, current_a):
            raise OutOfRange("; ".join(violations))
        await self._set(scpi.set_current(self._dialect, current_a), f"a current limit of {current_a:g} A")
        await self._set(scpi.set_voltage(self._dialect, voltage_v), f"a voltage of {voltage_v:g} V")
        found_v, found_a = await self._query("VOLT?", scpi.value), await self._query("CURR?", scpi.value)
        if abs(found_v - voltage_v) > self._section.readback_v or abs(found_a - current_a) > self._section.readback_a:
            raise DeviceFault(
                f"the supply was set to {voltage_v:g} V, {current_a:g} A and reads back {found_v:g} V, {found_a:g} A"
            )
        self._wanted = (voltage_v, current_a)

    async def switch_on(self) -> None:
        """Switch the output on and check that it is. Raises `DeviceFault`. One that has tripped stays off: some
        supplies clear a trip by that. Implements `Supply.switch_on`.
        """
        if await self._tripped():
            raise DeviceFault("the supply's protection has tripped: a person must reset it")
        if await self._query("OUTP?", scpi.switch):
            return
        await self.set_output(*(self._wanted or (self.limits.nominal_v, self.limits.nominal_a)))
        await self._switch(True)

    async def switch_off(self) -> None:
        """Switch the output off, if it is on, and check that it is off. Implements `Supply.switch_off`."""
        if await self._query("OUTP?", scpi.switch):
            await self._switch(False)

    async def read(self) -> SupplyReading:
        """Return measured voltage and current, the settings, whether the output is on, and status words. Implements
        `Supply.read`.
        """
        on = await self._query("OUTP?", scpi.switch)
        tripped = await self._tripped()
        set_v, set_a = await self._query("VOLT?", scpi.value), await self._query("CURR?", scpi.value)
        voltage, current = await self._query("MEAS:VOLT?", scpi.value), await self._query("MEAS:CURR?", scpi.value)
        if self._dialect.mode_query:
            mode = await self._query(self._dialect.mode_query, scpi.mode)
        else:
            limited = on and current > 0.97 * set_a and voltage < 0.97 * set_v
            mode = "CC" if limited else "CV" if on else "OFF"
        words = [StatusWord("mode", mode), StatusWord("protection", str(int(tripped)), ("tripped",) if tripped else ())]
        status: Status = tuple(words)
        on = on and not tripped
        return SupplyReading(self._clock.now_s(), on, voltage, current, mode == "CC", tripped, set_v, set_a, status)

    async def make_safe(self) -> None:
        """Switch the output off and check that it is off; what comes next is switched on at the nominal voltage.
        Implements `Supply.make_safe`.
        """
        await self.switch_off()
        self._wanted = None

    def close(self) -> None:
        """Drop the line; see `WireDevice`."""
        self._line.close()

    async def _switch(self, on: bool) -> None:
        word = "on" if on else "off"
        await self._set(scpi.set_output(self._dialect, on), f"switching {word}")
        if await self._query("OUTP?", scpi.switch) != on:
            raise DeviceFault(f"the supply was switched {word} and does not read back as {word}")

    async def _tripped(self) -> bool:
        query = self._dialect.trip_query
        return bool(query) and await self._query(query, scpi.switch)

    async def _query(self, words: str, read: Callable[[bytes], T]) -> T:
        data = scpi.line(self._dialect, scpi.header(self._dialect, words))
        return await accepted(self._line.ask(Request(data, words, read)), "supply", words)

    async def _set(self, statement: str, name: str) -> None:
        """Send a set and the query of its error in one piece, so that they share a line; neither is sent twice."""
        data = scpi.line(self._dialect, statement) + scpi.line(self._dialect, scpi.ERROR_QUERY)
        request = Request(data, name, scpi.no_error, demand=True)
        await accepted(self._line.ask(request), "supply", name)

    def _empty_errors(self, ask: Ask) -> None:
        """Read old errors away at a new line, so that none is taken for that of a later set."""
        request = Request(scpi.line(self._dialect, scpi.ERROR_QUERY), "its old errors", scpi.error)
        for _ in range(MOST_ERRORS):
            if ask(request)[0] == 0:
                return
        raise Refusal(f"its error queue does not come to an end within {MOST_ERRORS} errors")


def _identity(answer: bytes) -> DeviceIdentity:
    return DeviceIdentity(*scpi.identity(answer))


DRIVER = DeviceDriver("supply", "scpi", ScpiSection, ScpiSupply)
