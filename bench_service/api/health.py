"""Is it alive, is it ready."""

from fastapi import APIRouter
from pydantic import BaseModel

from bench_service.api.dependencies import Service
from bench_service.api.errors import problems

router = APIRouter(tags=["health"])


class Health(BaseModel):
    """The service answers; `code_version` is what would make a number now."""

    status: str = "ok"
    code_version: str


@router.get("/healthz")
def healthz(service: Service) -> Health:
    """The process answers."""
    return Health(code_version=service.code_version)


@router.get("/readyz", responses=problems())
def readyz(service: Service) -> Health:
    """The database answers and the bench's worker runs; waits for it after a start."""
    service.ready()
    return Health(code_version=service.code_version)
