"""Requests and answers over one line, and what happens when the line is lost in between. Blocking; knows no thread.

Rules: a request goes out on a line that is in step, which means that every earlier answer was read or the connection
was given up. A read may be repeated over a new connection, a demand never. After a reconnect the device's identity and
status are asked first.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from bench_service import wall_clock
from bench_service.drivers.answers import BadAnswer, shown
from bench_service.drivers.interface.address import Address
from bench_service.drivers.link.framing import NoFrame
from bench_service.drivers.link.transport import LineCut, Transport, open_transport
from procedures.bench.errors import DeviceBusy, Disconnected

T = TypeVar("T")
log = logging.getLogger(__name__)
AGAIN_S = 0.1
"""Pause before a line that was given up is made again where the device still holds it [s]."""


@dataclass(frozen=True)
class Request(Generic[T]):
    """A request to a device: the bytes to send, and the function that reads the answer."""

    data: bytes
    name: str
    """Name of the request in messages, as in "the set point"."""
    read: Callable[[bytes], T]
    """Function that returns an answer's value. Raises `BadAnswer` where the bytes do not answer this request, `Refusal`
    where the device refuses."""
    demand: bool = False
    """True if it changes the device: such a request is never sent twice."""
    answered: bool = True
    """False where the device sends no answer; `read` then gets empty bytes at once."""


@dataclass(frozen=True)
class LineTimes:
    """Time-outs of a line [s]: of an answer, of a whole request, of a connection, and of a rest after a demand."""

    answer_s: float = 2.0
    """Longest time from a request to its whole answer."""
    deadline_s: float = 6.0
    """Longest time of a verb's request, with waiting for its turn, a new connection and a second try."""
    connect_s: float = 2.0
    after_demand_s: float = 0.0
    """Pause after a demand, for controllers that lose a command that comes too soon."""


class Framer(Protocol):
    """Finds where one answer ends in what has arrived. Interface; see `framing`."""

    def take(self, buffer: bytearray) -> bytes | None: ...


class Greeting(Protocol):
    """First requests on each new connection: identity, then status. Interface of the drivers."""

    @property
    def identity(self) -> Request[Any]:
        """Request for the identity; its `read` refuses the answer to any other request."""
        ...

    def check(self, identity: Any, ask: "Ask") -> None:
        """Ask for status, compare the identity with the former one. Raises `BenchError` where it may not continue."""
        ...


class Ask(Protocol):
    """Function that sends a request on the new connection, without a second try, and returns the answer's value."""

    def __call__(self, request: Request[T]) -> T: ...


class _Lost(Exception):
    """No answer came: the line was cut, stayed silent, or sent what is no answer."""


@dataclass
class LineCounts:
    """Counts of what has happened to a line: requests, connections, silences, cuts, surplus bytes; for tests, metrics
    and messages.
    """

    requests: int = 0
    connections: int = 0
    silences: int = 0
    cuts: int = 0
    surplus: int = 0
    """Answers that nobody had asked for, as a doubled or a late one."""


class Exchange:
    """Requests and answers with one device over one line, which reconnects where that is allowed. Blocking, for one
    thread.
    """

    def __init__(self, device: str, address: Address, framer: Framer, greeting: Greeting, times: LineTimes) -> None:
        self.device, self.address, self.times = device, address, times
        self._framer, self._greeting = framer, greeting
        self._transport: Transport | None = None
        self._buffer = bytearray()
        self._stale = False
        self._not_before = 0.0
        self._closing = False
        self._greeted = False
        self.counts = LineCounts()

    def ask(self, request: Request[T], until: float) -> T:
        """Send a request and wait for the value of its answer, until a moment of the monotonic clock. Raises
        `Disconnected`, `DeviceBusy`, `Refusal`.
        """
        self._connect(until)
        try:
            return self._once(request, until)
        except _Lost as lost:
            self._give_up()
            if request.demand:
                raise Disconnected(
                    f"{self._named()}: {lost}; whether {request.name} was carried out is not known, and it is not "
                    "sent again"
                ) from None
            log.warning("%s: %s; %s is sent again over a new connection", self._named(), lost, request.name)
        self._connect(until)
        try:
            return self._once(request, until)
        except _Lost as lost:
            self._give_up()
            raise Disconnected(f"{self._named()} does not answer, also not to a second request: {lost}") from None

    def close(self) -> None:
        """Close the line; the next request opens it again."""
        if self._transport is not None:
            self._transport.close()
        self._transport = None
        self._buffer.clear()

    def stop(self) -> None:
        """End the request under way, from another thread: it raises `Disconnected`, and no new line is opened."""
        self._closing = True
        transport = self._transport
        if transport is not None:
            transport.cut()

    def _named(self) -> str:
        return f"the {self.device} at {self.address}"

    def _give_up(self) -> None:
        """Leave a line that is out of step. A serial one stays open and is brought into step by its identity."""
        if self._transport is not None and self.address.scheme == "serial":
            self._stale = True
            self._buffer.clear()
        else:
            self.close()

    def _connect(self, until: float) -> None:
        """Have a line in step: nothing in it that was not asked for, the device greeted.

        A controller may hold the former line for a while after it was given up: then it is tried again until the time
        is over. A device that was never reached is tried once.
        """
        if self._transport is not None and not self._stale and self._in_step():
            return
        while True:
            try:
                self._open(until)
                self._greet(until)
                self._greeted = True
                return
            except DeviceBusy:
                if not self._greeted or until - wall_clock.monotonic_s() < 2.0 * AGAIN_S:
                    raise
                wall_clock.pause(AGAIN_S)

    def _open(self, until: float) -> None:
        left = until - wall_clock.monotonic_s()
        if self._closing:
            raise Disconnected(f"the line of {self._named()} was closed by the service")
        if left <= 0.0:
            raise Disconnected(f"{self._named()} does not answer in time")
        if self._transport is None:
            try:
                self._transport = open_transport(self.address, min(left, self.times.connect_s))
            except LineCut as cut:
                raise Disconnected(f"{self._named()} cannot be reached: {cut}") from None
            self.counts.connections += 1

    def _in_step(self) -> bool:
        """Check that nothing stands in the line before a request; else leave it."""
        assert self._transport is not None
        try:
            rest = bytes(self._buffer) + self._transport.receive(0.0)
        except LineCut as cut:
            self.counts.cuts += 1
            log.warning("%s: the connection was lost between two requests: %s", self._named(), cut)
            self.close()
            return False
        if not rest:
            return True
        self.counts.surplus += 1
        log.warning("%s: an unexpected answer came: %s; the connection is closed", self._named(), shown(rest))
        self._give_up()
        return False

    def _greet(self, until: float) -> None:
        """Ask identity and status; on a line that cannot be dropped leave out what answers earlier requests."""
        stale, self._stale = self._stale, False
        try:
            identity = self._once(self._greeting.identity, until, leave_out_others=stale)
            self._greeting.check(identity, lambda request: self._once(request, until))
        except _Lost as lost:
            self._stale = stale
            self._give_up()
            raise DeviceBusy(
                f"{self._named()} connects but does not identify itself ({lost}): another master may hold it, or "
                "it speaks another dialect"
            ) from None
        except BaseException:
            self.close()
            raise

    def _once(self, request: Request[T], until: float, leave_out_others: bool = False) -> T:
        """Send a request and read its answer. Raises `_Lost`."""
        transport = self._transport
        if transport is None:
            raise _Lost("the line is closed")
        pause = self._not_before - wall_clock.monotonic_s()
        if pause > 0.0:
            wall_clock.pause(pause)
        self.counts.requests += 1
        until = min(until, wall_clock.monotonic_s() + self.times.answer_s)
        try:
            transport.send(request.data)
            while True:
                answer = self._answer(transport, request, until) if request.answered else b""
                try:
                    return request.read(answer)
                except BadAnswer as bad:
                    if not leave_out_others:
                        raise _Lost(f"the answer to {request.name} cannot be understood: {bad}") from None
        except LineCut as cut:
            self.counts.cuts += 1
            raise _Lost(f"the connection was lost at {request.name}: {cut}") from None
        finally:
            if request.demand and self.times.after_demand_s > 0.0:
                self._not_before = wall_clock.monotonic_s() + self.times.after_demand_s

    def _answer(self, transport: Transport, request: Request[T], until: float) -> bytes:
        """Read one answer. Raises `_Lost`, `LineCut`."""
        while True:
            try:
                answer = self._framer.take(self._buffer)
            except NoFrame as bad:
                raise _Lost(f"the answer to {request.name} has no end: {bad}") from None
            if answer is not None:
                return answer
            left = until - wall_clock.monotonic_s()
            if left <= 0.0:
                self.counts.silences += 1
                half = f", only {shown(bytes(self._buffer))} came" if self._buffer else ""
                raise _Lost(f"no answer to {request.name} within {self.times.answer_s:g} s{half}")
            self._buffer += transport.receive(left)
