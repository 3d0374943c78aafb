"""Routes of mountings: who mounted which unit on which plate of which bench, and the azimuth that was read."""

from datetime import datetime
from typing import Annotated

from fastapi import Query, Response
from pydantic import AwareDatetime, BaseModel, Field

from bench_service.access.service import require_team
from bench_service.api.http.dependencies import After, By, ClientName, IdempotencyKey, Limit, Me, ProvenName, Service
from bench_service.api.http.errors import made, problems
from bench_service.api.http.fields import NAME, Request
from bench_service.bench.mountings import MountingEntry, new_mounting
from bench_service.mapping import copied
from bench_service.model.mountings import StoredMounting
from bench_service.model.records import Idempotency
from bench_service.routing import Routes
from bench_service.wall_clock import now

router = Routes(prefix="/api/v1/mountings", tags=["mountings"])


class MountingSubmission(Request):
    """A mounting as a person enters it, once the azimuth is read (thesis 5.1, steps 1 to 4)."""

    unit: str = NAME
    bench: Annotated[str, NAME] | None = Field(None, description="null: the bench of jobs that name none")
    plate: str = NAME
    azimuth_deg: float = Field(
        ge=-360.0,
        le=360.0,
        allow_inf_nan=False,
        description="Heading of the unit's x at zero table angles, from north [deg]",
    )
    azimuth_sd_arcsec: float = Field(
        ge=0.0, le=3600.0, allow_inf_nan=False, description="Standard uncertainty of that reading"
    )
    mounted_at: AwareDatetime | None = Field(None, description="null: now")
    instrument: str = Field("", max_length=200, description="Instrument of the reading: theodolite and prism")
    by: By | None = None
    remark: str = Field("", max_length=500)


class MountingEnd(Request):
    """Request to end a mounting: the unit was taken off."""

    by: By | None = None


class MountingView(BaseModel):
    """A mounting of a unit on a plate of a bench."""

    id: str
    unit: str
    bench: str
    plate: str
    by: str = Field(description="Person who mounted it")
    proven: bool = Field(description="Whether the person was authenticated; else the name was declared")
    mounted_at: datetime
    entered_at: datetime
    azimuth_deg: float
    azimuth_sd_arcsec: float
    instrument: str
    remark: str
    stands: bool = Field(description="Whether the unit is still mounted so")
    ended_at: datetime | None
    ended_by: str

    @classmethod
    def of(cls, mounting: StoredMounting) -> "MountingView":
        """Convert a mounting to its HTTP view."""
        return copied(cls, mounting)


class MountingPage(BaseModel):
    """One page of mountings, newest first."""

    items: list[MountingView]
    next: str | None = Field(description="Cursor: pass it as `after` for the next page")


@router.post(
    "",
    status_code=201,
    responses={**problems(404, 409, 413, 507), **made(201, "mounting_id", "read_mounting", "end_mounting")},
)
def enter_mounting(
    body: MountingSubmission,
    service: Service,
    response: Response,
    me: Me,
    client: ClientName,
    proven: ProvenName,
    key: IdempotencyKey = None,
) -> MountingView:
    """Enter a mounting. Those before it of the same unit and of the same plate end; new jobs use its azimuth."""
    context = service.planner.context(body.unit, body.bench)
    bench = context.bench.id
    if not me.in_every_team:
        require_team(me, service.queues.team_of_bench(bench), f"bench {bench}")
    by = proven or body.by or client
    entered = new_mounting(copied(MountingEntry, body, bench=bench, by=by, proven=proven is not None))
    asked = Idempotency.of("mountings", key, body)
    stored = service.stores.mountings.add(entered, asked)
    response.headers["Location"] = f"/api/v1/mountings/{stored.id}"
    return MountingView.of(stored)


@router.get("", responses=problems())
def list_mountings(
    service: Service,
    unit: Annotated[str | None, Query(max_length=100, description="Only mountings of this unit")] = None,
    bench: Annotated[str | None, Query(max_length=100, description="Only mountings on this bench")] = None,
    standing: Annotated[bool, Query(description="Only mountings that are in place")] = False,
    after: After = None,
    limit: Limit = 50,
) -> MountingPage:
    """List the mountings, newest first."""
    page = service.stores.mountings.list(unit=unit, bench=bench, standing=standing, after=after, limit=limit)
    return MountingPage(items=[MountingView.of(one) for one in page.items], next=page.next)


@router.get("/{mounting_id}", responses=problems(404))
def read_mounting(mounting_id: str, service: Service) -> MountingView:
    """Read one mounting by its id."""
    return MountingView.of(service.stores.mountings.get(mounting_id))


@router.post("/{mounting_id}/end", responses=problems(404, 409, 413, 507))
def end_mounting(
    mounting_id: str, body: MountingEnd, service: Service, me: Me, client: ClientName, proven: ProvenName
) -> MountingView:
    """End a mounting: the unit was taken off. The bench's declared azimuth counts again for its jobs."""
    if not me.in_every_team:
        bench = service.stores.mountings.get(mounting_id).bench
        require_team(me, service.queues.team_of_bench(bench), f"bench {bench}")
    return MountingView.of(service.stores.mountings.end(mounting_id, now(), proven or body.by or client))
