"""Audit trail of HTTP requests: every request that may change something and reached a route, with its outcome."""

import asyncio
import json
import logging
from datetime import datetime
from functools import partial
from typing import Annotated, Any

from fastapi import Query, Request
from pydantic import BaseModel, Field
from starlette.concurrency import run_in_threadpool
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench_service.api.access.identify import found_of
from bench_service.api.http.bodies import is_json
from bench_service.api.http.dependencies import (
    NO_CONTROL_CHARACTERS,
    REQUESTED_BY,
    WHO_LENGTH,
    After,
    Limit,
    Service,
    as_utf8,
)
from bench_service.api.http.errors import FieldError, problems, respond
from bench_service.background import WorkInOrder
from bench_service.formats.plain_json import faults, mended, shown
from bench_service.mapping import copied
from bench_service.routing import Routes
from bench_service.telemetry.audit import AuditEntry, AuditTrail, write
from bench_service.telemetry.log_context import request_id
from bench_service.telemetry.redaction import without_tokens
from bench_service.wall_clock import new_id, now

router = Routes(prefix="/api/v1/audit", tags=["audit"])

READING = ("GET", "HEAD", "OPTIONS")
NOTED_BYTES = 8192
"""Size up to which a JSON body is part of the entry [bytes]; of longer bodies and of files, only the size is."""


class AuditView(BaseModel):
    """One audit entry: the client, its request and the outcome."""

    id: str
    at: datetime
    who: str = Field(description=f"Authenticated name; without accounts `{REQUESTED_BY}`, or the address of the client")
    action: str = Field(
        description="`operationId` of the request in this document, such as `cancel`; of other acts, a name such as "
        "`stop`"
    )
    target: str = Field(description="Path of the object of the operation, or of the object that it created")
    outcome: str = Field(description="Status code of the answer, or a word for entries that are not requests")
    detail: dict[str, Any]

    @classmethod
    def of(cls, entry: AuditEntry) -> "AuditView":
        said = mended(entry.detail)  # of an older service's entry, a thousand brackets would close the whole trail
        return copied(cls, entry, detail=said)


class AuditPage(BaseModel):
    """One page of audit entries, newest first."""

    items: list[AuditView]
    next: str | None = Field(description="Cursor: pass it as `after` for the next page")


@router.get("", responses=problems())
def list_audit(
    service: Service,
    who: Annotated[str | None, Query(max_length=WHO_LENGTH)] = None,
    target: Annotated[
        str | None, Query(max_length=200, description="Path of the object, or a part of it such as an id")
    ] = None,
    after: After = None,
    limit: Limit = 50,
) -> AuditPage:
    """List the audit entries, newest first: the client, its request and the outcome."""
    page = service.stores.audit.list(who=who, target=target, after=after, limit=limit)
    return AuditPage(items=[AuditView.of(entry) for entry in page.items], next=page.next)


STOP = "stop"
"""Name of the route that stops a bench."""
STOP_S = 0.3
"""Longest time that the answer to a stop waits for its audit entry; a later entry is written all the same [s]."""
STOPS_WAITING = 1000
"""Maximum number of stops whose entries wait for a database that hangs; further entries go to the log. With one thread
per entry, a client that sends thousands of stops would leave no thread for the stops themselves."""

log = logging.getLogger(__name__)


class Audited:
    """ASGI middleware that lets a route do the act, writes its audit entry, and then sends the answer. See
    `bench_service.telemetry.audit`.
    """

    def __init__(self, app: ASGIApp, trail: AuditTrail) -> None:
        self._app = app
        self._trail = trail
        self._of_stops = WorkInOrder("audit of stops", STOPS_WAITING)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] in READING:
            await self._app(scope, receive, send)
            return
        request = Request(scope)
        who = as_utf8(request.headers.get(REQUESTED_BY))
        if who is not None and not (0 < len(who) <= WHO_LENGTH and NO_CONTROL_CHARACTERS.match(who)):
            field = FieldError(field=REQUESTED_BY, message=f"1 … {WHO_LENGTH} characters, no control characters")
            await respond(request, 422, f"{field.field}: {field.message}", "Invalid", [field])(scope, receive, send)
            return
        act = _Act(request, who)

        async def receive_and_note() -> Message:
            message = await receive()
            act.body(message)
            return message

        async def note_and_send(message: Message) -> None:
            if message["type"] == "http.response.start":
                await self._note(act, message["status"], dict(message.get("headers", ())))
            await send(message)

        try:
            await self._app(scope, receive_and_note, note_and_send)
        except Exception:
            await self._note(act, 500, {})
            raise

    async def _note(self, act: "_Act", status: int, headers: dict[bytes, bytes]) -> None:
        route = act.request.scope.get("route")
        if act.noted or route is None or status == 405:
            return
        act.noted = True
        target = headers.get(b"location", b"").decode() or shown(act.request.scope["path"])
        entry = AuditEntry(new_id(), now(), act.who, route.name, target, str(status), act.detail())
        work = partial(write, self._trail, entry)
        if route.name != STOP:
            await run_in_threadpool(work)
            return
        # in a thread of its own, and not waited for for long: a stop is answered while the database is not
        written = self._of_stops.add(work)
        if written is None:
            log.error("an entry of the audit trail could not be written (%d wait already): %s", STOPS_WAITING, entry)
        else:
            await asyncio.wait((asyncio.wrap_future(written),), timeout=STOP_S)


class _Act:
    """The parts of a request that its audit entry needs, collected until the outcome is known."""

    def __init__(self, request: Request, claimed: str | None) -> None:
        self.request = request
        self._claimed = claimed
        self.noted = False
        self._is_json = is_json(request.headers.get("content-type"))
        self._body = b""
        self._bytes = 0

    @property
    def who(self) -> str:
        """Authenticated name; without accounts the name that the client gave, else its address."""
        client = self.request.client
        return found_of(self.request.scope).name(self._claimed) or (client.host if client else "local")

    def body(self, message: Message) -> None:
        """Note a piece of the body that passes."""
        piece: bytes = message.get("body", b"")
        self._bytes += len(piece)
        if self._is_json and self._bytes <= NOTED_BYTES:
            self._body += piece

    def detail(self) -> dict[str, Any]:
        """The request's details for the audit entry; never the contents of files, nor what could not be read back."""
        found: dict[str, Any] = {"request": request_id(), "path": shown(self.request.scope["path"])}
        sender = found_of(self.request.scope)
        identity = sender.identity or sender.stopper
        if identity is not None and identity.proven:
            found["proof"] = identity.proof.value
        if self._claimed not in (None, sender.name(self._claimed)):
            found["claimed"] = self._claimed
        if self.request.url.query:
            found["query"] = self.request.url.query[:500]
        body = self._document()
        if body is not None:
            found["body"] = body
        elif self._bytes:
            found["bytes"] = self._bytes
        return found

    def _document(self) -> Any:
        """Return the body where it is storable JSON, and not too long."""
        if not (self._is_json and 0 < self._bytes <= NOTED_BYTES):
            return None
        try:
            body = json.loads(self._body)
        except (ValueError, RecursionError):
            return None
        if next(faults(body), None) is not None:
            return None
        if getattr(self.request.scope.get("route"), "name", "") in WITH_PASSWORD:  # or a password under a mistyped name
            body = {name: body[name] for name in NO_SECRETS if name in body} if isinstance(body, dict) else None
        return json.loads(without_tokens(json.dumps(body)))


WITH_PASSWORD = frozenset({"log_in", "add_account", "change_account"})
"""Routes whose bodies have a password."""
NO_SECRETS = ("name", "role", "team")
"""Fields of the bodies of `WITH_PASSWORD` routes that the audit entry keeps; all others are dropped."""
