"""Errors as pages: a person who opens an address gets a sentence and a way on, a program its problem document."""

import gzip
import json
from collections.abc import MutableMapping
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

PROBLEM = "application/problem+json"
OF_PROGRAMS = ("/api/", "/static/", "/words/", "/healthz", "/readyz", "/metrics", "/openapi.json")


class ErrorPages:
    """ASGI middleware that turns a problem document of a page's address into an HTML page, where the client accepts
    HTML.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["path"].startswith(OF_PROGRAMS) or not _wants_page(scope):
            await self._app(scope, receive, send)
            return
        held: MutableMapping[str, Any] = {}
        body = bytearray()

        async def sent(message: Message) -> None:
            if message["type"] == "http.response.start" and _is_problem(message):
                held.update(message)
                return
            if not held:
                await send(message)
                return
            body.extend(message.get("body", b""))
            if not message.get("more_body", False):
                await _show(scope, held, bytes(body), send)

        await self._app(scope, receive, sent)


def _wants_page(scope: Scope) -> bool:
    return "text/html" in Headers(scope=scope).get("accept", "")


def _is_problem(message: Message) -> bool:
    return Headers(raw=message["headers"]).get("content-type", "").startswith(PROBLEM)


async def _show(scope: Scope, start: MutableMapping[str, Any], body: bytes, send: Send) -> None:
    from bench_service.pages.rendering import templates  # with the other pages: a server that starts does without

    packed = Headers(raw=start["headers"]).get("content-encoding") == "gzip"
    problem = json.loads(gzip.decompress(body) if packed else body)
    page = templates.TemplateResponse(Request(scope), "error.html", {"problem": problem}, status_code=start["status"])
    headers = MutableHeaders(raw=list(start["headers"]))
    headers["content-type"] = "text/html; charset=utf-8"
    del headers["content-encoding"]
    headers["content-length"] = str(len(page.body))
    await send({"type": "http.response.start", "status": start["status"], "headers": headers.raw})
    await send({"type": "http.response.body", "body": bytes(page.body)})
