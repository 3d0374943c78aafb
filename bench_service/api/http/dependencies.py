"""Dependencies and parameters that several routes share."""

import re
from typing import Annotated

from fastapi import Depends, Header, Query, Request
from pydantic import AfterValidator, Field

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
        description="A create that is repeated with the same key and body gives what the first one made",
    ),
]
REQUESTED_BY = "X-Requested-By"
WHO_LENGTH = 200
By = Annotated[
    str,
    Field(
        min_length=1,
        max_length=WHO_LENGTH,
        pattern=NO_CONTROL_CHARACTERS.pattern,
        description=f"Who does it; without it, `{REQUESTED_BY}` counts",
    ),
]


def as_utf8(text: str | None) -> str | None:
    """Read a header as the UTF-8 that browsers send; one that is none stays as it came (ISO 8859-1)."""
    try:
        return None if text is None else text.encode("latin-1").decode("utf-8")
    except (UnicodeEncodeError, UnicodeDecodeError):
        return text


RequestedBy = Annotated[
    str | None,
    AfterValidator(as_utf8),
    Header(
        alias=REQUESTED_BY,
        min_length=1,
        max_length=WHO_LENGTH,
        pattern=NO_CONTROL_CHARACTERS.pattern,
        description="Who asks, for the job and the audit trail; without it, the trail has the client's address",
    ),
]


async def _client_name(request: Request, requested_by: RequestedBy = None) -> str:
    return requested_by or (request.client.host if request.client else "local")


ClientName = Annotated[str, Depends(_client_name)]
"""Name of the client: the one that it gives itself, or the address that it asks from."""
After = Annotated[str | None, Query(max_length=100, description="Cursor: `next` of the page before")]
Limit = Annotated[int, Query(ge=1, le=500)]
