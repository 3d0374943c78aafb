"""A stream of bytes that holds a place among heavy requests (`bench_service.evidence.admission`) while it lasts."""

import logging
from collections.abc import Callable

import anyio
from fastapi.responses import StreamingResponse
from starlette.types import Message, Receive, Scope, Send

from bench_service.evidence.admission import Places
from bench_service.model.errors import Overloaded
from bench_service.wall_clock import monotonic_s, pause_async

STALLED_S = 60.0
"""Time after which a client that takes no more bytes of a stream is let go [s]: it holds a place of others."""

WAIT_S = 10.0
"""Longest time that a request waits for a place [s]."""
LOOK_S = 0.05
"""Interval at which a waiting request looks for a place [s]."""
WAITING = 50
"""Number of requests that may wait for a place; they hold no thread."""

log = logging.getLogger(__name__)
_waiting = 0


async def place_in_turn(places: Places, wanted_bytes: int) -> Callable[[], None]:
    """Wait for a place where others have them all, and return the function that gives it back, see `Places.take`.
    Raises `Overloaded`.
    """
    global _waiting
    deadline = monotonic_s() + WAIT_S
    _waiting += 1
    try:
        while True:
            try:
                return places.take(wanted_bytes)
            except Overloaded:
                if _waiting > WAITING or monotonic_s() > deadline:
                    raise
            await pause_async(LOOK_S)
    finally:
        _waiting -= 1


class AdmittedStream(StreamingResponse):
    """A streaming response that gives its place back at its end, however it ends; a client that stalls is cut off."""

    give_back: Callable[[], None] = staticmethod(lambda: None)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_in_time(message: Message) -> None:
            with anyio.fail_after(STALLED_S):
                await send(message)

        try:
            await super().__call__(scope, receive, send_in_time)
        except TimeoutError:  # the server closes the connection of an answer that does not end
            log.warning("%s: the client read nothing for %g s; its stream is closed", scope["path"], STALLED_S)
        finally:
            self.give_back()
