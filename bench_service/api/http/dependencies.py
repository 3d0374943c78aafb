"""Dependencies and parameters that several routes share."""

import re
from typing import Annotated

from fastapi import Depends, Header, Query, Request
from pydantic import AfterValidator, Field

from bench_service.access.identity import Identity, Proof
from bench_service.access.roles import Role
from bench_service.api.access.identify import Found, found_of
from bench_service.jobs.events.hub import EventHub
from bench_service.service import BenchService


async def _service(request: Request) -> BenchService:  # async: else it is looked up in a thread, for each request
    return request.app.state.service


async def _hub(request: Request) -> EventHub:
    return request.app.state.hub


Hub = Annotated[EventHub, Depends(_hub)]
Service = Annotated[BenchService, Depends(_service)]
NO_CONTROL_CHARACTERS = re.compile(r"^[^\x00-\x1f\x7f]+$")
IdempotencyKey = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=200,
        pattern=NO_CONTROL_CHARACTERS.pattern,
        description="A create repeated with the same key and body returns the result of the first one",
    ),
]
NOBODY = Identity("", Role.VIEWER, Proof.NONE, proven=False)
"""Somebody on this host who has not logged in, and may only stop a bench."""
REQUESTED_BY = "X-Requested-By"
WHO_LENGTH = 200
By = Annotated[
    str,
    Field(
        min_length=1,
        max_length=WHO_LENGTH,
        pattern=NO_CONTROL_CHARACTERS.pattern,
        description=f"Name of the person who acts; default: `{REQUESTED_BY}`",
    ),
]


def as_utf8(text: str | None) -> str | None:
    """Return a header's text, which browsers send as UTF-8, decoded; one that is not UTF-8 stays ISO 8859-1. None for
    no header.
    """
    try:
        return None if text is None else text.encode("latin-1").decode("utf-8")
    except (UnicodeEncodeError, UnicodeDecodeError):
        return text


_Claimed = Annotated[
    str | None,
    AfterValidator(as_utf8),
    Header(
        alias=REQUESTED_BY,
        min_length=1,
        max_length=WHO_LENGTH,
        pattern=NO_CONTROL_CHARACTERS.pattern,
        description=(
            "Name of the person who sends it, for the job and the audit trail; used only without a log-in. Without "
            "either, the trail has the client's address"
        ),
    ),
]


async def _identity(request: Request) -> Identity:
    return found_of(request.scope).identity or NOBODY


async def _found(request: Request) -> Found:
    return found_of(request.scope)


async def _proven_name(request: Request) -> str | None:
    return found_of(request.scope).proven_name


Sender = Annotated[Found, Depends(_found)]
"""Everything that is known of the sender of the request."""
Me = Annotated[Identity, Depends(_identity)]
"""The identity of the request; on routes that need none it may be nobody's."""
ProvenName = Annotated[str | None, Depends(_proven_name)]
"""The name that the request has proved; None where a client names itself."""


async def _requested_by(sender: Sender, claimed: _Claimed = None) -> str | None:
    return sender.name(claimed)


RequestedBy = Annotated[str | None, Depends(_requested_by)]
"""Name of the person or program that asks: the proved one, or the one that a client gives itself; None: not given."""


async def _client_name(request: Request, requested_by: RequestedBy) -> str:
    return requested_by or (request.client.host if request.client else "local")


ClientName = Annotated[str, Depends(_client_name)]
"""Name of the client: the proved one, the one that it gives itself, or the address that it asks from."""
After = Annotated[str | None, Query(max_length=100, description="Cursor: `next` of the page before")]
Limit = Annotated[int, Query(ge=1, le=500)]
