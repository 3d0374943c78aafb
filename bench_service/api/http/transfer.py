"""Transfer of answers: their header alone for HEAD, and compressed where a client takes that."""

from fastapi import FastAPI
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench_service.formats.export import ExportFormat

LEAST_BYTES = 1000
"""Size below which an answer is not compressed: it would still be one packet [bytes]."""
LEVEL = 4
"""Level of compression: a tenth of the time of the highest one for a few percent of the size."""
AS_THEY_ARE = (*DEFAULT_EXCLUDED_CONTENT_TYPES, *(form.media_type for form in ExportFormat), "application/octet-stream")
"""Samples are not compressed: it would take longer than the transfer on the bench's own network."""


def install(app: FastAPI) -> None:
    """Add to an application the answer to HEAD wherever GET is answered, and the compression of texts."""
    app.add_middleware(HeadOfGet)
    app.add_middleware(GZipMiddleware, minimum_size=LEAST_BYTES, compresslevel=LEVEL, exclude_content_types=AS_THEY_ARE)


class _Enough(OSError):
    """Raised into an answer whose header is all that was wanted: to its maker the client is gone."""


class HeadOfGet:
    """ASGI middleware that answers HEAD as GET without the body; a stream ends before its first piece is made."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return
        ended = False

        async def send_header(message: Message) -> None:
            nonlocal ended
            if ended:
                raise _Enough
            if message["type"] == "http.response.start":
                scope["method"] = "HEAD"  # as the server must see it, which else waits for a body
                await send(message)
                await send({"type": "http.response.body", "body": b""})
                ended = True

        scope["method"] = "GET"  # in this very scope: what is found here, such as the route, is read further out
        try:
            await self._app(scope, receive, send_header)
        except (_Enough, ClientDisconnect):
            if not ended:
                raise
        finally:
            scope["method"] = "HEAD"
