"""Routes of reservations of a bench or a unit. Jobs of other clients wait until the reservation ends."""

from datetime import datetime, timedelta
from typing import Annotated

from fastapi import Query, Response
from pydantic import AwareDatetime, BaseModel, Field, model_validator

from bench_service.api.access.teams import TeamOfReservation
from bench_service.api.http.dependencies import After, IdempotencyKey, Limit, Me, Service
from bench_service.api.http.errors import made, problems
from bench_service.api.http.fields import NAME, Request
from bench_service.jobs.queue_service import LONGEST, ReservationRequest
from bench_service.jobs.reservation import Reservation, Reserved
from bench_service.mapping import copied
from bench_service.routing import Routes
from bench_service.wall_clock import now

router = Routes(prefix="/api/v1/reservations", tags=["reservations"])


class ReservationSubmission(Request):
    """Request to reserve a bench or a unit: until when, and for whom."""

    bench: Annotated[str, NAME] | None = Field(None, description="Bench to reserve; give either this or `unit`")
    unit: Annotated[str, NAME] | None = None
    holder: str = NAME
    until: AwareDatetime | None = Field(None, description="End of the reservation; give either this or `minutes`")
    minutes: float | None = Field(None, gt=0, le=LONGEST / timedelta(minutes=1), allow_inf_nan=False)
    note: str = Field("", max_length=500)

    @model_validator(mode="after")
    def _one_of_each(self) -> "ReservationSubmission":
        for pair in (("bench", "unit"), ("until", "minutes")):
            if sum(getattr(self, name) is not None for name in pair) != 1:
                raise ValueError(f"exactly one of {pair[0]} and {pair[1]} is needed")
        return self


class ReservationView(BaseModel):
    """A reservation of a bench or a unit. It ends by itself at `until`."""

    id: str
    bench: str | None
    unit: str | None
    holder: str
    note: str
    team: str = Field(description="Team whose members act on it and on its jobs; empty: everybody")
    created_at: datetime
    until: datetime
    ended_at: datetime | None = Field(description="When it was given back before its time")
    active: bool = Field(description="Whether it is active now")

    @classmethod
    def of(cls, kept: Reservation) -> "ReservationView":
        """Convert a reservation to its HTTP view."""
        return copied(
            cls,
            kept,
            bench=kept.name if kept.kind is Reserved.BENCH else None,
            unit=kept.name if kept.kind is Reserved.UNIT else None,
            active=kept.active(now()),
        )


class ReservationPage(BaseModel):
    """One page of reservations, newest first."""

    items: list[ReservationView]
    next: str | None = Field(description="Cursor: pass it as `after` for the next page")


@router.post(
    "",
    status_code=201,
    responses={**problems(404, 409, 413, 507), **made(201, "reservation_id", "read_reservation", "end_reservation")},
)
def reserve(
    body: ReservationSubmission, service: Service, response: Response, me: Me, key: IdempotencyKey = None
) -> ReservationView:
    """Reserve a bench or a unit, for the team of the account or token that asks.

    One that is reserved already is refused, with the holder and the end.
    """
    kind = Reserved.UNIT if body.bench is None else Reserved.BENCH
    name = body.bench or body.unit or ""
    kept = service.queues.reserve(copied(ReservationRequest, body, kind=kind, name=name, team=me.team), key)
    response.headers["Location"] = f"/api/v1/reservations/{kept.id}"
    return ReservationView.of(kept)


@router.get("", responses=problems())
def list_reservations(
    service: Service,
    active: Annotated[bool, Query(description="Only reservations that are active now")] = False,
    after: After = None,
    limit: Limit = 50,
) -> ReservationPage:
    """List the reservations, newest first."""
    page = service.stores.reservations.list(active_at=now() if active else None, after=after, limit=limit)
    return ReservationPage(items=[ReservationView.of(kept) for kept in page.items], next=page.next)


@router.get("/{reservation_id}", responses=problems(404))
def read_reservation(reservation_id: str, service: Service) -> ReservationView:
    """Read one reservation by its id."""
    return ReservationView.of(service.stores.reservations.get(reservation_id))


@router.delete("/{reservation_id}", responses=problems(404, 507), dependencies=[TeamOfReservation])
def end_reservation(reservation_id: str, service: Service) -> ReservationView:
    """End a reservation before its time: jobs that waited for it may start. One that is over stays as it is."""
    return ReservationView.of(service.queues.give_back(reservation_id))
