"""Limits on request bodies, for every route: a bounded length, and JSON that can be stored and sent again."""

from email.message import Message as Header
from itertools import islice

from fastapi import Request
from fastapi.exceptions import RequestValidationError
from fastapi.params import Form
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench_service.formats.plain_json import faults

BODY_BYTES = 1_000_000
"""Largest body of a route that takes no files; in an upload, the room for the description of the files."""
SMALL_BYTES = 10_000
"""Length up to which a body is checked at once, in a few milliseconds, without a thread [bytes]."""
TOLD = 20
"""Most faults of a body that an answer lists."""


def is_json(content_type: str | None) -> bool:
    """Return whether a body of this type is read as JSON, by the rule that FastAPI uses."""
    header = Header()
    header["content-type"] = content_type or ""
    kind = header.get_content_subtype()
    return header.get_content_maintype() == "application" and (kind == "json" or kind.endswith("+json"))


async def only_plain_json(request: Request) -> None:
    """Dependency of every route: refuses a JSON body with a value that the database or a client cannot hold, before it
    is used.

    Raises `RequestValidationError` with the fields.
    """
    if _takes_json(request.scope) and is_json(request.headers.get("content-type")) and await request.body():
        body = await request.body()
        if len(body) <= SMALL_BYTES:  # at once: the threads may all be at work, and a stop has such a body too
            refuse_unfit(await request.json(), "body")
        else:  # a megabyte of zeros takes 0.3 s
            await run_in_threadpool(refuse_unfit, await request.json(), "body")


def refuse_unfit(document: object, place: str) -> None:
    """Check the JSON of a request. `place`: where it was sent, "body" or the name of a form's field. Raises
    `RequestValidationError` with the values that cannot be stored.
    """
    found = list(islice(faults(document), TOLD))
    if found:
        raise RequestValidationError(
            [{"type": "unfit", "loc": (place, *f.path), "msg": f.allowed, "input": f.value} for f in found]
        )


class Bounded:
    """ASGI middleware that refuses a body that is too long, before it is read or as soon as it exceeds the limit."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        came = 0

        async def receive_so_much() -> Message:
            nonlocal came
            most = _most_bytes(scope)  # asked here: before the body is read, no route is found yet
            if most is None:
                return await receive()
            _refuse_longer(_declared_bytes(scope), most)
            message = await receive()
            came += len(message.get("body", b""))
            _refuse_longer(came, most)
            return message

        await self._app(scope, receive_so_much, send)


def _most_bytes(scope: Scope) -> int | None:
    """Return the longest body that a route takes; None: it takes none."""
    if _takes_json(scope):
        return BODY_BYTES
    if getattr(scope.get("route"), "body_field", None) is None:
        return None
    return scope["app"].state.max_import_bytes + BODY_BYTES  # files, with what describes and parts them


def _takes_json(scope: Scope) -> bool:
    """Return whether the route has a body that is not a form."""
    field = getattr(scope.get("route"), "body_field", None)
    return field is not None and not isinstance(field.field_info, Form)


def _declared_bytes(scope: Scope) -> int:
    declared = Headers(scope=scope).get("content-length", "")
    return int(declared) if declared.isdecimal() else 0


def _refuse_longer(size: int, most: int) -> None:
    if size > most:  # of FastAPI's reading of a body, this kind of error alone comes out as it is
        raise HTTPException(413, f"the body has {size} bytes or more: at most {most} bytes are accepted")
