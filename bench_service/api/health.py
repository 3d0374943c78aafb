"""Health routes for monitoring: liveness and readiness of the service."""

from fastapi import Request
from pydantic import BaseModel, Field

from bench_service.api.access.identify import found_of
from bench_service.api.http.dependencies import Service
from bench_service.api.http.errors import problems
from bench_service.routing import Routes

router = Routes(tags=["health"])


class Health(BaseModel):
    """Health of the service that answers; `code_version` is the version that a new result would carry."""

    status: str = "ok"
    code_version: str
    notes: list[str] = Field(
        default_factory=list[str], description="Notes for a person: a stopped bench, a broken catalogue file"
    )


@router.get("/healthz", responses=problems())
async def healthz(service: Service) -> Health:
    """Report that the process answers, whatever its threads are busy with."""
    return Health(code_version=service.code_version)


@router.get("/readyz", responses=problems())
def readyz(service: Service, request: Request) -> Health:
    """Report whether a job could start: the database answers, its disk has room, the engine runs, the lease is held.

    Waits for the engine after a start. 503 names every reason. A stopped bench refuses by a person's will: a note,
    which a sender without log-in does not see.
    """
    notes = service.ready()
    return Health(code_version=service.code_version, notes=list(notes) if found_of(request.scope).identity else [])
