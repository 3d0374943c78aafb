"""Requests to an ACUTROL controller over its line: states, interlocks, limits, demands, each set read back."""

from collections.abc import Callable, Sequence
from typing import Literal, TypeVar

from pydantic import Field

from bench_service.drivers.answers import Refusal
from bench_service.drivers.devices.wire import Greeting, Note, accepted, line_times
from bench_service.drivers.interface.driver import Bound
from bench_service.drivers.interface.sections import NonNegative, Positive, WireTurntable
from bench_service.drivers.link.exchange import Ask, Request
from bench_service.drivers.link.framing import Framing
from bench_service.drivers.link.line import DeviceLine
from bench_service.drivers.protocols import acutrol
from bench_service.drivers.protocols.acutrol import AxisState, Dialect, Mode, Quantity
from procedures.bench.device import DeviceIdentity, Status, StatusWord
from procedures.bench.errors import DeviceFault

T = TypeVar("T")
ENDINGS = {"crlf": b"\r\n", "lf": b"\n", "cr": b"\r"}
TURN_SETS, TURN_SETTLES_S = 8, 3.0
"""Statements before and after whole turns, and bench time for rest, the way back and rest again [s]."""
ANSWER_S, CROWDED_S = 0.04, 0.5
"""Time of an answer, and of all readings of rest together, on a crowded machine [s, real time]."""
SENT_BACK = 10.0**-acutrol.DECIMALS
"""Largest difference of a demand read back: one unit of its last decimal."""


class AcutrolSection(WireTurntable):
    """Section of an ACUTROL table. Sources of the protocol disagree: port, prefix and endings are settings."""

    reply_prefix_bytes: int = Field(default=8, ge=0, le=64)
    ending: Literal["crlf", "lf", "cr"] = "crlf"
    reply_ending: Literal["crlf", "lf", "cr"] = "crlf"
    acknowledgement: str = Field(default="OK", max_length=16)
    """Answer to a statement that is no query; empty: there is none."""
    after_demand_s: NonNegative = 0.3
    """Pause after a statement that is no query [s]: the controller loses commands that come sooner."""
    encoder: Literal["multi_turn", "single_turn"] = "multi_turn"
    """"single_turn": readings repeat each turn, and the driver counts the turns of axes without slip rings."""
    demand_query: bool = True
    """False for a controller that does not answer `:demand:position?`: then the reached angle alone is read back."""
    tolerance_deg: Positive = 0.001
    """Largest distance from the demand at rest [deg]."""
    rest_rate_deg_s: Positive = 0.001
    """Largest rate at rest [deg/s]."""
    settle_s: Positive = 30.0
    """Longest time between the planned end of a motion and rest [s]."""

    def turn_extra_s(self, factor: float) -> float:
        """Time of the statements that begin and end whole turns, and of settling [s, bench time]."""
        return factor * (TURN_SETS * (self.after_demand_s + ANSWER_S) + CROWDED_S) + TURN_SETTLES_S


class AcutrolLink:
    """Controller of three axes as typed requests over its line; knows its language, and no motion. Every request waits,
    and raises `Disconnected`, `DeviceFault`.
    """

    def __init__(self, section: AcutrolSection, note: Note) -> None:
        self.axes = (section.outer.number, section.middle.number, section.inner.number)
        self._section = section
        self._dialect = Dialect(
            section.reply_prefix_bytes, ENDINGS[section.ending], ENDINGS[section.reply_ending], section.acknowledgement
        )
        identity = self._request(acutrol.IDENTITY_QUERY, "its identity", self._identity)
        self._greeting = Greeting("turntable", identity, self._first_words, note)
        framing = Framing(self._dialect.reply_ending, section.reply_prefix_bytes)
        self._line = DeviceLine(
            "turntable", section.address, framing, self._greeting, line_times(section, section.after_demand_s)
        )
        self.own: tuple[Bound, ...] = ()
        """Factory limits of the axes, known once a line was made."""

    async def identify(self) -> DeviceIdentity:
        """Ask for maker, model, serial and firmware, and return them."""
        return await self._ask(acutrol.IDENTITY_QUERY, self._identity)

    async def states(self) -> tuple[AxisState, ...]:
        """Return position [deg] and rate [deg/s] of outer, middle and inner axis, read by one request."""
        return await self._ask(
            acutrol.states_query(self.axes), lambda a: acutrol.states(self._dialect, a, len(self.axes))
        )

    async def status(self) -> Status:
        """Return the status words: the status byte, and the interlock of each axis."""
        byte = await self._ask(acutrol.STATUS_QUERY, lambda a: acutrol.status_byte(self._dialect, a))
        bits = tuple(acutrol.STATUS_BITS.get(n, f"bit {n}") for n in range(8) if byte >> n & 1)
        words = [StatusWord("*stb?", str(byte), bits)]
        for axis in self.axes:
            state = await self._word(acutrol.interlock_query(axis))
            words.append(StatusWord(f"interlock {axis}", state, (state,)))
        return tuple(words)

    async def require_closed(self) -> Status:
        """Read the interlocks and return the status. Raises `DeviceFault` where one is not closed; none is reset or
        closed here.
        """
        status = await self.status()
        for word in status:
            if word.name.startswith("interlock") and word.raw != "closed":
                raise DeviceFault(
                    f"{word.name} of the turntable is {word.raw}: find out why, then reset and close it at the "
                    "controller"
                )
        if "interlock fault" in status[0].bits:
            raise DeviceFault(f"the turntable reports an interlock fault ({status[0]}): a person must reset it")
        return status

    async def limit(self, mode: Mode, index: int, rate_deg_s: float, acceleration_deg_s2: float) -> None:
        """Set rate and acceleration of one mode of an axis, and read both back; one that reads so already is left."""
        axis = self.axes[index]
        quantities: tuple[tuple[Quantity, float], ...] = (("rate", rate_deg_s), ("acc", acceleration_deg_s2))
        for quantity, value in quantities:
            if abs(await self._number(acutrol.limit_query(quantity, mode, axis)) - value) <= SENT_BACK:
                continue
            await self._set(acutrol.limit_statement(quantity, mode, axis, value))
            found = await self._number(acutrol.limit_query(quantity, mode, axis))
            self._same(f"{quantity} limit of axis {axis} in {mode} mode", value, found)

    async def demand(self, kind: Literal["position", "rate"], index: int, value: float) -> None:
        """Load a demand of an axis (position [deg] or rate [deg/s]), and read it back. Raises `DeviceFault` where it
        reads otherwise.
        """
        axis = self.axes[index]
        make = acutrol.position_demand if kind == "position" else acutrol.rate_demand
        await self._set(make(axis, value))
        if self._section.demand_query:
            found = await self._number(acutrol.demand_query(kind, axis))
            self._same(f"{kind} demand of axis {axis}", value, found)

    async def oscillator(self, index: int, amplitude_deg: float, frequency_hz: float) -> None:
        """Load a sinusoid of an axis. No query of it was seen: its motion is what is read back."""
        await self._set(acutrol.oscillator_demand(self.axes[index], amplitude_deg, frequency_hz, 0.0))

    async def mode(self, mode: Mode, indices: Sequence[int] = (0, 1, 2)) -> None:
        """Set the mode of some axes at which a loaded demand acts, and read it back; an axis in it is left alone.
        Raises `DeviceFault`.
        """
        for index in indices:
            axis = self.axes[index]
            if is_mode(await self.mode_of(index), mode):
                continue
            await self._set(acutrol.mode_statement(axis, mode))
            found = await self.mode_of(index)
            if not is_mode(found, mode):
                raise DeviceFault(f"axis {axis} of the turntable was set to {mode} mode and reads back {found}")

    async def mode_of(self, index: int) -> str:
        """Return the mode of an axis, in lower case, as the controller says it."""
        return await self._word(acutrol.mode_query(self.axes[index]))

    def close(self) -> None:
        """Drop the line to the table, without waiting."""
        self._line.close()

    async def _set(self, statement: str) -> None:
        request = self._request(
            statement, statement, lambda answer: acutrol.acknowledged(self._dialect, answer), demand=True
        )
        await accepted(self._line.ask(request), "turntable", statement)

    async def _number(self, query: str) -> float:
        return (await self._ask(query, lambda a: acutrol.numbers(self._dialect, a, 1)))[0]

    async def _word(self, query: str) -> str:
        return await self._ask(query, lambda a: acutrol.word(self._dialect, a))

    async def _ask(self, query: str, read: Callable[[bytes], T]) -> T:
        return await accepted(self._line.ask(self._request(query, query, read)), "turntable", query)

    def _request(self, statement: str, name: str, read: Callable[[bytes], T], demand: bool = False) -> Request[T]:
        answered = not demand or bool(self._dialect.acknowledgement)
        return Request(acutrol.line(self._dialect, statement), name, read, demand, answered)

    def _same(self, name: str, demanded: float, found: float) -> None:
        if abs(found - demanded) > SENT_BACK:
            raise DeviceFault(f"{name} of the turntable was set to {demanded:g} and reads back {found:g}")

    def _identity(self, answer: bytes) -> DeviceIdentity:
        return DeviceIdentity(*acutrol.identity(self._dialect, answer))

    def _first_words(self, ask: Ask) -> None:
        """Status and factory limits, at each new line."""
        query = acutrol.STATUS_QUERY
        ask(self._request(query, query, lambda a: acutrol.status_byte(self._dialect, a)))
        found: list[Bound] = []
        for name, axis in zip(("outer", "middle", "inner"), self.axes, strict=True):
            query = acutrol.absolute_limits_query(axis)
            try:
                own = ask(self._request(query, query, lambda a: acutrol.absolute_limits(self._dialect, a)))
            except Refusal:
                continue
            found += [
                Bound(f"{name}.minimum_deg", own.minimum_deg),
                Bound(f"{name}.maximum_deg", own.maximum_deg),
                Bound(f"{name}.rate_deg_s", own.rate_deg_s),
                Bound(f"{name}.acceleration_deg_s2", own.acceleration_deg_s2),
            ]
        self.own = tuple(found)


def is_mode(word: str, mode: Mode) -> bool:
    """Return whether a controller's word names a mode; that of the synthesizer was seen in its short form alone."""
    return word.startswith(acutrol.MODES["synthesis"]) if mode == "synthesis" else word == mode
