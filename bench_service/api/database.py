"""Routes of the database as a whole: its size, its last check and copy, and the reports of all of them."""

from datetime import datetime
from typing import Any

from pydantic import BaseModel, Field

from bench_service.api.http.dependencies import After, Limit, Service
from bench_service.api.http.errors import problems
from bench_service.mapping import copied
from bench_service.routing import Routes
from bench_service.telemetry.upkeep import UpkeepKind, UpkeepReport

router = Routes(prefix="/api/v1/database", tags=["health"])


class UpkeepView(BaseModel):
    """A check of the database, or a copy of it, and its outcome."""

    id: str
    kind: UpkeepKind
    began_at: datetime
    ended_at: datetime | None = Field(description="null: under way, or its process died")
    by: str
    good: bool | None = Field(description="false where something is wrong; null while it has not ended")
    document: dict[str, Any] = Field(
        description="Report of a check: faults, number of recordings checked, each damaged chunk with its samples"
    )

    @classmethod
    def of(cls, report: UpkeepReport) -> "UpkeepView":
        """Convert a report to its HTTP view."""
        return copied(cls, report)


class UpkeepPage(BaseModel):
    """One page of reports, newest first."""

    items: list[UpkeepView]
    next: str | None


class DatabaseView(BaseModel):
    """The database of the service: its size, and the last check and copy that have ended."""

    kind: str = Field(description="sqlite or postgresql")
    revision: str | None = Field(description="Revision of its tables")
    stored_bytes: int
    log_bytes: int | None = Field(description="Length of SQLite's write-ahead log")
    free_bytes: int | None = Field(description="Free space on the disk of an SQLite file [bytes]")
    last_scrub: UpkeepView | None
    last_backup: UpkeepView | None


@router.get("", responses=problems())
def read_database(service: Service) -> DatabaseView:
    """Read the size of the database, and the outcome of its last check and its last copy."""
    upkeep = service.stores.upkeep
    scrub, backup = upkeep.last(UpkeepKind.SCRUB), upkeep.last(UpkeepKind.BACKUP)
    return copied(
        DatabaseView,
        service.upkeep.size(),
        last_scrub=None if scrub is None else UpkeepView.of(scrub),
        last_backup=None if backup is None else UpkeepView.of(backup),
    )


@router.get("/reports", responses=problems())
def list_upkeep(service: Service, kind: UpkeepKind | None = None, after: After = None, limit: Limit = 50) -> UpkeepPage:
    """List the checks and copies of the database, newest first."""
    page = service.stores.upkeep.list(kind=kind, after=after, limit=limit)
    return UpkeepPage(items=[UpkeepView.of(report) for report in page.items], next=page.next)
