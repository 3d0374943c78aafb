"""The line of one device as the bench's loop sees it: one thread, one queue, a deadline for each request."""

import asyncio
import queue
import threading
from concurrent.futures import Future
from typing import Any, NamedTuple, TypeVar

from bench_service import wall_clock
from bench_service.drivers.interface.address import Address
from bench_service.drivers.link.exchange import Exchange, Framer, Greeting, LineCounts, LineTimes, Request
from procedures.bench.errors import Disconnected

T = TypeVar("T")
WAITING = 64
"""Number of requests that may wait for a line."""


class _Asked(NamedTuple):
    request: Request[Any]
    until: float
    answer: "Future[Any]"


class DeviceLine:
    """Line whose waiting is done by a thread of its own, so that no verb holds the bench's loop.

    A request that was cancelled while it waited is not sent. One that is under way is read to its end, so that its
    answer is never taken for another's.
    """

    def __init__(self, device: str, address: Address, framer: Framer, greeting: Greeting, times: LineTimes) -> None:
        self._exchange = Exchange(device, address, framer, greeting, times)
        self._named = f"the {device} at {address}"
        self._queue: queue.Queue[_Asked | None] = queue.Queue(WAITING)
        self._thread: threading.Thread | None = None
        self._begin = threading.Lock()
        self._closed = False

    @property
    def counts(self) -> LineCounts:
        """Counts of what has happened to the line."""
        return self._exchange.counts

    async def ask(self, request: Request[T], within_s: float | None = None) -> T:
        """Send a request and wait, without holding the loop, for the value of the answer. Raises `Disconnected`,
        `DeviceBusy`, `Refusal`.
        """
        return await asyncio.wrap_future(self._put(request, within_s))

    def _put(self, request: Request[T], within_s: float | None) -> "Future[T]":
        times = self._exchange.times
        until = wall_clock.monotonic_s() + (times.deadline_s if within_s is None else within_s)
        answer: Future[T] = Future()
        with self._begin:
            if self._closed:
                raise Disconnected(f"the line of {self._named} was closed by the service")
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name=f"line {self._named}", daemon=True)
                self._thread.start()
            try:
                self._queue.put_nowait(_Asked(request, until, answer))
            except queue.Full:
                raise Disconnected(f"{self._named} does not answer: {WAITING} requests wait for its answer") from None
        return answer

    def _run(self) -> None:
        while (asked := self._queue.get()) is not None:
            if not asked.answer.set_running_or_notify_cancel():
                continue
            if asked.until <= wall_clock.monotonic_s():
                asked.answer.set_exception(
                    Disconnected(f"{self._named} did not come to {asked.request.name} in time; it was not sent")
                )
                continue
            try:
                asked.answer.set_result(self._exchange.ask(asked.request, asked.until))
            except BaseException as failure:
                asked.answer.set_exception(failure)
        self._exchange.close()

    def close(self) -> None:
        """Close the line without waiting; idempotent. The request under way and those that wait raise."""
        with self._begin:
            if self._closed:
                return
            self._closed = True
            while True:
                try:
                    waiting = self._queue.get_nowait()
                except queue.Empty:
                    break
                if waiting is not None and waiting.answer.set_running_or_notify_cancel():
                    waiting.answer.set_exception(Disconnected(f"the line of {self._named} was closed by the service"))
            self._queue.put_nowait(None)
        self._exchange.stop()

    def ended(self, within_s: float) -> bool:
        """Wait for the thread after `close`, at most `within_s`; return True if it has ended."""
        if self._thread is not None:
            self._thread.join(within_s)
        return self._thread is None or not self._thread.is_alive()
