"""A stream of bytes that holds a place among heavy requests (`bench_service.evidence.admission`) while it lasts."""

from collections.abc import Callable

import anyio
from fastapi.responses import StreamingResponse
from starlette.types import Message, Receive, Scope, Send

STALLED_S = 60.0
"""Time after which a client that takes no more bytes of a stream is let go [s]: it holds a place of others."""


class AdmittedStream(StreamingResponse):
    """A stream that gives its place back at its end, however it ends; a client that stalls is let go."""

    give_back: Callable[[], None] = staticmethod(lambda: None)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_in_time(message: Message) -> None:
            with anyio.fail_after(STALLED_S):
                await send(message)

        try:
            await super().__call__(scope, receive, send_in_time)
        finally:
            self.give_back()
