"""Routes of raw data over the years: sizes and predictions, retention, archive, restoration, and holds."""

from datetime import datetime
from typing import Annotated

from fastapi import Query
from pydantic import BaseModel, Field

from bench_service.api.http.dependencies import ClientName, ProvenName, Service
from bench_service.api.http.errors import problems
from bench_service.api.http.fields import Request
from bench_service.api.recording_views import RecordingView
from bench_service.mapping import copied
from bench_service.model.raw_data import Growth, Hold, Keeping, Prediction, RawPlan, RawState, Share, StorageReport
from bench_service.routing import Routes

router = Routes(prefix="/api/v1", tags=["health"])


class StorageView(BaseModel):
    """The size of the database, where raw data are, how they grow, and how large the database will be."""

    stored_bytes: int = Field(description="Size of the database [bytes]")
    reusable_bytes: int | None = Field(description="Free space inside the SQLite file, used first [bytes]")
    free_bytes: int | None = Field(description="Free space on the disk of an SQLite file [bytes]")
    raw: dict[RawState, Share] = Field(description="Recordings and their bytes by where the raw data are")
    growth: Growth = Field(description="Mean growth of the last 30 days, or since the first recording")
    predicted: list[Prediction] = Field(description="Predicted sizes without and with the rules below")
    full_at: datetime | None = Field(description="When the disk is full; null: not within ten years, or not known")
    remove_days: float | None = Field(description="BENCH_RAW_DAYS")
    archive_days: float | None = Field(description="BENCH_ARCHIVE_DAYS")
    archive: str | None = Field(description="BENCH_ARCHIVE")

    @classmethod
    def of(cls, report: StorageReport) -> "StorageView":
        """Convert a report to its HTTP view."""
        return copied(cls, report, raw=dict(report.raw), predicted=list(report.predicted))


class RuleRequest(Request):
    """Request to apply a rule to raw data."""

    days: float | None = Field(None, gt=0, le=36_525, description="Age in days; null: as the settings say")
    dry_run: bool = Field(True, description="true: only report what would be removed")


class PlanView(BaseModel):
    """The recordings that a rule concerns, and what was done."""

    days: float
    before: datetime = Field(description="Recordings created before this time are old enough")
    recordings: list[str] = Field(description="The first 200 recordings of the plan")
    stored_bytes: int = Field(description="Bytes of all recordings that the rule concerns")
    kept: dict[Keeping, int] = Field(description="Number of recordings that are old enough and kept, by the reason")
    done: int = Field(description="Recordings whose raw data went; 0 of a dry run")
    done_bytes: int
    faults: list[str] = Field(description="Recordings that could not be moved, and stay in the database")

    @classmethod
    def of(cls, plan: RawPlan) -> "PlanView":
        """Convert a plan to its HTTP view."""
        return copied(cls, plan, days=plan.rule.days)


class HoldRequest(Request):
    """Request to hold a recording's raw data."""

    reason: str = Field(min_length=1, max_length=1000)


class HoldView(BaseModel):
    """A hold on a recording: no rule removes its raw data while it stands."""

    id: str
    recording: str
    reason: str
    by: str
    held_at: datetime
    released_at: datetime | None
    released_by: str

    @classmethod
    def of(cls, hold: Hold) -> "HoldView":
        """Convert a hold to its HTTP view."""
        return copied(cls, hold)


@router.get("/storage", responses=problems())
def read_storage(service: Service) -> StorageView:
    """Read the size of the database, where raw data are, and how large it will be."""
    return StorageView.of(service.raw_data.report())


@router.post("/storage/retention", responses=problems(413, 507))
def remove_raw_data(body: RuleRequest, service: Service) -> PlanView:
    """Remove the raw data of routine passes that are old enough, or say what would go (`dry_run`, the default).

    Hashes, descriptions, results and lineage stay. Kept is what a current or approved calibration or correction rests
    on, what is held, what an analysis wants that has not ended, and what belongs to an open campaign run.
    """
    return PlanView.of(service.raw_data.remove(body.days, body.dry_run))


@router.post("/storage/archive", responses=problems(413, 507))
def archive_raw_data(body: RuleRequest, service: Service) -> PlanView:
    """Move raw data that are old enough to the archive, or say what would go (`dry_run`, the default).

    Each chunk is copied, read back and compared with its hash before it leaves the database. Readers notice nothing.
    """
    return PlanView.of(service.raw_data.archive(body.days, body.dry_run))


@router.post("/recordings/{recording_id}/restore", responses=problems(404, 409, 410, 507))
def restore_raw_data(recording_id: str, service: Service) -> RecordingView:
    """Bring a recording's raw data back from the archive into the database, each chunk checked against its hash."""
    return RecordingView.of(service.raw_data.restore(recording_id))


@router.post("/recordings/{recording_id}/holds", status_code=201, responses=problems(404, 409, 410, 413, 507))
def hold_raw_data(
    recording_id: str, body: HoldRequest, service: Service, client: ClientName, proven: ProvenName
) -> HoldView:
    """Hold a recording's raw data: no rule removes them while the hold stands."""
    return HoldView.of(service.raw_data.hold(recording_id, body.reason, proven or client))


@router.get("/storage/holds", responses=problems())
def list_holds(service: Service, recording: Annotated[str | None, Query(max_length=100)] = None) -> list[HoldView]:
    """List the standing holds, newest first."""
    return [HoldView.of(hold) for hold in service.stores.raw_data.holds(recording)]


@router.post("/storage/holds/{hold_id}/release", responses=problems(404, 409, 507))
def release_hold(hold_id: str, service: Service, client: ClientName, proven: ProvenName) -> HoldView:
    """Release a hold; the rules see to the recording again."""
    return HoldView.of(service.raw_data.release(hold_id, proven or client))
