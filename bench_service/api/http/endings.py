"""Answers to requests that reach no route, or that the end of the service cuts off."""

from asyncio import CancelledError

from fastapi import FastAPI, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench_service.api.http.errors import respond


def install(app: FastAPI) -> None:
    """Add to an application the refusal of addresses with NUL, and the answer to requests still at work at the end."""
    app.add_middleware(RefuseNul)
    app.add_middleware(AnswerAtTheEnd)


class AnswerAtTheEnd:
    """ASGI middleware that answers every request still at work when the server's grace period is over.

    Such a request may be repeated: what it asked for may be done or not, which its `Idempotency-Key` sorts out. A
    stream ends, unfinished.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        begun = False

        async def sent(message: Message) -> None:
            nonlocal begun
            begun = True
            await send(message)

        try:
            await self._app(scope, receive, sent)
        except CancelledError:
            if scope["type"] != "http":
                raise
            if begun:  # a stream, cut here: the server closes its connection, and the client sees that it is not whole
                return
            text = "the service is shutting down: send this request again, with the same Idempotency-Key"
            await respond(Request(scope), 503, text, "Ending")(scope, receive, send)


class RefuseNul:
    """ASGI middleware that refuses addresses with the character NUL, which no database can hold in a text."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and ("\x00" in scope["path"] or b"%00" in scope["query_string"]):
            refusal = respond(Request(scope), 400, "an address may not contain the character NUL", "BadRequest")
            await refusal(scope, receive, send)
            return
        await self._app(scope, receive, send)
