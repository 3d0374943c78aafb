"""Routes of the audit trail's chain: check it, and close a stretch whose retention has ended."""

from dataclasses import asdict
from datetime import datetime
from typing import Annotated

from fastapi import Query
from pydantic import AwareDatetime, BaseModel, Field

from bench_service.api.http.dependencies import ClientName, Service
from bench_service.api.http.errors import problems
from bench_service.api.http.fields import Request
from bench_service.mapping import copied
from bench_service.routing import Routes
from bench_service.telemetry.audit_chain import ChainReport, Checkpoint
from bench_service.wall_clock import now
from procedures.core.errors import BadParameter

router = Routes(prefix="/api/v1/audit", tags=["audit"])

Expected = Annotated[
    str | None,
    Query(pattern="^[0-9a-f]{64}$", description="Digest of an earlier check, which must still be in the chain"),
]


class CheckpointView(BaseModel):
    """A closed stretch of the chain: its entries are gone, and the chain continues from its digest."""

    first: int
    last: int
    first_at: datetime
    last_at: datetime
    digest: str
    closed_at: datetime
    closed_by: str

    @classmethod
    def of(cls, one: Checkpoint) -> "CheckpointView":
        """Convert a checkpoint to its HTTP view."""
        return cls(**{name: value for name, value in asdict(one).items() if name in cls.model_fields})


class ChainView(BaseModel):
    """Outcome of a check of the whole chain of audit entries."""

    whole: bool = Field(description="Whether no entry was changed, removed or inserted")
    faults: list[str] = Field(description="Faults found, by entry; at most 20")
    entries: int = Field(description="Entries that were checked")
    sequence: int = Field(description="Place of the newest entry in the chain")
    digest: str = Field(
        description="Digest of the newest entry; kept elsewhere, it proves later that no entry is missing"
    )
    checkpoints: list[CheckpointView] = Field(description="Closed stretches, oldest first")

    @classmethod
    def of(cls, report: ChainReport) -> "ChainView":
        """Convert a report to its HTTP view."""
        return copied(
            cls, report, faults=list(report.faults), checkpoints=[CheckpointView.of(one) for one in report.checkpoints]
        )


class Closing(Request):
    """Request to remove the entries whose retention has ended."""

    before: AwareDatetime = Field(description="Entries before this time are removed; a checkpoint replaces them")


@router.get("/chain", responses=problems())
def verify_audit(service: Service, expect: Expected = None) -> ChainView:
    """Check the audit trail, entry by entry: `whole` is false where one was changed, removed or put in between."""
    return ChainView.of(service.stores.audit.verify(expect))


@router.post("/close", responses=problems(404, 409, 413, 507))
def close_audit(body: Closing, service: Service, client: ClientName) -> list[CheckpointView]:
    """Remove the entries before a moment, and leave a checkpoint in their place. A broken stretch is not removed."""
    at = now()
    if body.before > at:
        raise BadParameter("before", body.before.isoformat(), f"a moment in the past, before {at.isoformat()}")
    return [CheckpointView.of(one) for one in service.stores.audit.close(body.before, client, at)]
