"""What every route is given, and what several of them say in the same words."""

from typing import Annotated

from fastapi import Depends, Header, Query, Request

from bench_service.jobs.event_hub import EventHub
from bench_service.jobs.service import BenchService


def _service(request: Request) -> BenchService:
    return request.app.state.service


def _hub(request: Request) -> EventHub:
    return request.app.state.hub


Hub = Annotated[EventHub, Depends(_hub)]
Service = Annotated[BenchService, Depends(_service)]
IdempotencyKey = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=200,
        description="A create that is repeated with the same key and body gives what the first one made",
    ),
]
After = Annotated[str | None, Query(max_length=100, description="Cursor: `next` of the page before")]
Limit = Annotated[int, Query(ge=1, le=500)]
