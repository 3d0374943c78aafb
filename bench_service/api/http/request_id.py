"""Request ids: the client's own `X-Request-ID` or a new one, in the answer and in every log line of the request."""

import re

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench_service.telemetry.log_context import about
from bench_service.wall_clock import new_id

HEADER = "X-Request-ID"
ACCEPTED = re.compile(r"[A-Za-z0-9._:/+=@-]{1,100}")
"""Allowed ids; any other is replaced by a new one: a header must not write lines into the log."""


class RequestId:
    """ASGI middleware that gives each request an id, for the answer's header and the log; it never delays a stream."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get(HEADER, "")
        name = given if ACCEPTED.fullmatch(given) else new_id()

        async def send_with_id(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message)[HEADER] = name
            await send(message)

        with about(request=name):
            await self._app(scope, receive, send_with_id)
