"""Routes of manual mode: an operator's lease on an idle bench, and demands under it.

Live readings come with the bench (`live.manual`, `live.devices`) and over the feed.
"""

from typing import Annotated, Any

from fastapi import Body, Response

from bench_service.access.service import require_team
from bench_service.api.access.teams import TeamOfBench, TeamOfLease
from bench_service.api.http.dependencies import After, ClientName, IdempotencyKey, Limit, Me, ProvenName, Service
from bench_service.api.http.errors import made, problems
from bench_service.api.manual.schemas import (
    AnyDemand,
    DemandPage,
    DemandView,
    LeaseEnd,
    LeasePage,
    LeaseView,
    ManualSubmission,
    Renewal,
)
from bench_service.jobs.manual.service import ManualRequest
from bench_service.mapping import copied
from bench_service.model.errors import NotFound
from bench_service.routing import Routes

router = Routes(prefix="/api/v1/benches/{bench_id}/manual", tags=["manual mode"])


@router.post(
    "",
    status_code=201,
    dependencies=[TeamOfBench],
    responses={**problems(404, 409, 413, 507), **made(201, "lease_id", "read_manual", "end_manual")},
)
def begin_manual(
    bench_id: str,
    body: ManualSubmission,
    service: Service,
    response: Response,
    me: Me,
    client: ClientName,
    proven: ProvenName,
    key: IdempotencyKey = None,
) -> LeaseView:
    """Begin manual mode on an idle bench. No job starts there before the lease has ended and the bench is safe.

    It is refused while a job runs, while the bench is stopped, and where another holder's reservation holds. Under a
    reservation, members of its team begin, command and end it.
    """
    require_team(me, service.queues.team_of(body.reservation), f"reservation {body.reservation}")
    holder = proven or body.by or client
    asked = copied(ManualRequest, body, bench=bench_id, holder=holder, proven=proven is not None)
    lease = service.manual.begin(asked, key)
    response.headers["Location"] = f"/api/v1/benches/{bench_id}/manual/{lease.id}"
    return LeaseView.of(lease)


@router.get("", responses=problems(404))
def list_manual(bench_id: str, service: Service, after: After = None, limit: Limit = 50) -> LeasePage:
    """List the leases of a bench, newest first."""
    page = service.manual.leases(bench_id, after, limit)
    return LeasePage(items=[LeaseView.of(one) for one in page.items], next=page.next)


@router.get("/now", responses=problems(404))
def read_manual_now(bench_id: str, service: Service) -> LeaseView:
    """Read the lease that a bench has now; 404 where it is not in manual mode."""
    lease = service.manual.on(bench_id)
    if lease is None:
        raise NotFound("manual lease", "now", f"bench {bench_id} is not in manual mode")
    return LeaseView.of(lease)


@router.get("/{lease_id}", responses=problems(404))
def read_manual(bench_id: str, lease_id: str, service: Service) -> LeaseView:
    """Read one lease by its id."""
    return LeaseView.of(service.manual.lease(bench_id, lease_id))


@router.post("/{lease_id}/renew", responses=problems(404, 409, 413, 507), dependencies=[TeamOfLease])
def renew_manual(
    bench_id: str, lease_id: str, body: Renewal, service: Service, client: ClientName, proven: ProvenName
) -> LeaseView:
    """Move the end of one's own lease, counted from now on."""
    return LeaseView.of(service.manual.renew(bench_id, lease_id, body.minutes, proven or body.by or client))


@router.post("/{lease_id}/end", responses=problems(404, 413, 507), dependencies=[TeamOfLease])
def end_manual(
    bench_id: str,
    lease_id: str,
    service: Service,
    client: ClientName,
    proven: ProvenName,
    body: LeaseEnd | None = None,
) -> LeaseView:
    """End a lease: the bench is made safe, and its queue continues. `ended_at` is set once that is done."""
    by = proven or (body.by if body is not None else None) or client
    return LeaseView.of(service.manual.end(bench_id, lease_id, by))


@router.post(
    "/{lease_id}/demands",
    status_code=202,
    responses=problems(404, 409, 413, 507),
    dependencies=[TeamOfLease],
)
def demand_by_hand(
    bench_id: str,
    lease_id: str,
    body: Annotated[AnyDemand, Body()],
    service: Service,
    client: ClientName,
    proven: ProvenName,
    key: IdempotencyKey = None,
) -> DemandView:
    """Accept a demand of the lease's holder; one beyond a limit is refused with field, value and range.

    What becomes of it is read by its key. Sent again with its Idempotency-Key it is the same demand.
    """
    values: dict[str, Any] = body.model_dump(exclude={"kind", "by"})
    holder = proven or body.by or client
    return DemandView.of(service.manual.demand(bench_id, lease_id, body.kind, values, holder, key))


@router.get("/{lease_id}/demands", responses=problems(404))
def list_demands(bench_id: str, lease_id: str, service: Service, after: After = None, limit: Limit = 50) -> DemandPage:
    """List the demands of a lease, newest first."""
    page = service.manual.demands(bench_id, lease_id, after, limit)
    return DemandPage(items=[DemandView.of(one) for one in page.items], next=page.next)


@router.get("/{lease_id}/demands/{key}", responses=problems(404))
def read_demand(bench_id: str, lease_id: str, key: str, service: Service) -> DemandView:
    """Read one demand by its key, with what became of it."""
    return DemandView.of(service.manual.demand_of(bench_id, lease_id, key))
