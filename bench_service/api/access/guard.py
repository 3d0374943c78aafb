"""Decision at each route: has the sender of a request the right that the route needs?

It is made before the body is read, and again as a dependency of every route, for requests without a body.
"""

import hmac

from fastapi import Request
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench_service.access.identity import Identity
from bench_service.access.roles import Right
from bench_service.access.service import AccessService, require
from bench_service.api.access.identify import CSRF_HEADER, Found, found_of
from bench_service.api.access.rights import READING, right_of
from bench_service.api.http.errors import AccessRefused
from bench_service.api.http.headers import quoted
from bench_service.model.errors import NotAllowed
from bench_service.wall_clock import now

LOG_IN_PAGE = "/log-in"


async def authorised(request: Request) -> None:
    """Dependency of every route: checks that the sender has the right that the route needs. Raises `AccessRefused`."""
    authorise(request.scope)


def authorise(scope: Scope) -> None:
    """Refuse a request whose sender has not the right that its route needs. Raises `AccessRefused`."""
    route, found, headers = scope["route"], found_of(scope), Headers(scope=scope)
    right = right_of(route.name, scope["method"])
    if right is Right.OPEN:
        return
    if found.identity is None:
        if right is Right.STOP and (found.local or found.stopper is not None):
            return  # a stop never waits for a log-in: on this host it needs none, elsewhere an ended session will do
        _refuse(found, route, scope)
        return
    try:
        require(found.identity, right)
    except NotAllowed as refusal:  # as an HTTP error: of those alone the reading of a body lets the answer out
        raise AccessRefused(403, "NotAllowed", str(refusal)) from refusal
    if right is not Right.STOP:
        _check_csrf(found.identity, scope["method"], headers)


def _refuse(found: Found, route: object, scope: Scope) -> None:
    if _is_page(route, scope):
        path = scope["path"] + ("?" + scope["query_string"].decode("latin-1") if scope["query_string"] else "")
        where = LOG_IN_PAGE if path == "/" else f"{LOG_IN_PAGE}?next={quoted(path)}"
        raise AccessRefused(303, "NotLoggedIn", "log in first", {"Location": where, "Cache-Control": "no-store"})
    if found.refusal is None:
        raise AccessRefused(401, "NotLoggedIn", "log in first", {"WWW-Authenticate": "Bearer"})
    headers = {"WWW-Authenticate": "Bearer"} if found.refusal.status == 401 else {}
    raise AccessRefused(found.refusal.status, found.refusal.kind, found.refusal.text, headers)


def _is_page(route: object, scope: Scope) -> bool:
    """Return whether a route is a page for a person, who can be led to the log-in."""
    shown = not getattr(route, "include_in_schema", True) and not scope["path"].endswith((".svg", ".json"))
    return shown and scope["method"] in READING


def _check_csrf(identity: Identity, method: str, headers: Headers) -> None:
    """Refuse a change that no page of the session has made: a browser sends cookies by itself, this value it does not.

    The stop is exempt, so that a page left open since an earlier log-in stops too; its origin is checked all the same.
    """
    if identity.csrf is None or method in READING:
        return
    if not hmac.compare_digest(headers.get(CSRF_HEADER, "").encode(), identity.csrf.encode()):
        text = f"a change by a log-in's cookie needs the header {CSRF_HEADER}, with `csrf` of GET /api/v1/session"
        raise AccessRefused(403, "CsrfToken", text)


class Guarded:
    """ASGI middleware that checks the sender's right before a body is read, and ends a stream of events once that right
    ends.
    """

    def __init__(self, app: ASGIApp, access: AccessService) -> None:
        self._app = app
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        decided = streams = ended = False

        async def receive_if_allowed() -> Message:
            nonlocal decided
            if not decided and "route" in scope:
                authorise(scope)
                decided = True
            return await receive()

        async def send_while_allowed(message: Message) -> None:
            nonlocal streams, ended
            if message["type"] == "http.response.start":
                streams = Headers(raw=message["headers"]).get("content-type", "").startswith("text/event-stream")
            elif streams and not ended and not self._still(scope):
                ended = True
                await send({"type": "http.response.body", "body": b"", "more_body": False})
            if not ended:
                await send(message)

        await self._app(scope, receive_if_allowed, send_while_allowed)

    def _still(self, scope: Scope) -> bool:
        identity = found_of(scope).identity
        return identity is not None and self._access.still_valid(identity, now())
