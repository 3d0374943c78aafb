"""Routes of benches: descriptions, current state, queues and software stops."""

from fastapi.exceptions import RequestValidationError

from bench_service.api.access.teams import TeamOfBench
from bench_service.api.benches.schemas import (
    BenchView,
    QueueEntryView,
    QueueView,
    ReleaseRequest,
    Releasing,
    ReservedView,
    SafetyView,
    StopPage,
    Stopping,
    StopRequest,
    StopView,
)
from bench_service.api.benches.stop_threads import stop_in_own_thread
from bench_service.api.http.dependencies import (
    REQUESTED_BY,
    After,
    ClientName,
    IdempotencyKey,
    Limit,
    RequestedBy,
    Sender,
    Service,
)
from bench_service.api.http.errors import problems
from bench_service.jobs.reservation import reservation_of_bench
from bench_service.mapping import copied
from bench_service.model.records import reasons_of
from bench_service.routing import Routes
from bench_service.service import BenchService
from bench_service.wall_clock import now

router = Routes(prefix="/api/v1/benches", tags=["benches"])


def view_of(service: BenchService, bench_id: str) -> BenchView:
    """Return the view of a bench: description, live state, safety, running job, queue. Raises `NotFound`."""
    description = service.benches.description(bench_id)
    running = service.jobs.driving_job(bench_id)
    live = service.live.of_bench(bench_id)
    stops = service.stores.benches.standing_stops(bench_id)
    by_hand = service.stores.manual.open_on(bench_id) is not None
    return BenchView(
        id=bench_id,
        description=description,
        state="stopped" if stops else "busy" if running is not None else "manual" if by_hand else "idle",
        stopped=f"{stops[0].at.isoformat()}: {reasons_of(stops)}" if stops else None,
        stops=[StopView.of(stop) for stop in stops],
        job=running,
        units=[unit.serial for unit in service.benches.mounted(bench_id)],
        live=live,
        driver_seen_at=None if live is None else live.at,
        driver_there=live is not None and live.there(now()),
        safety=SafetyView.of(service.safety.known(bench_id)),
        driven_by=service.benches.holder(bench_id),
        queued=service.stores.queue.lengths().get(bench_id, 0),
        reserved=_reserved(service, bench_id),
    )


def _reserved(service: BenchService, bench_id: str) -> ReservedView | None:
    """The reservation that a bench is under now; None where it is under none."""
    kept = reservation_of_bench(service.stores.reservations, bench_id, now())
    return None if kept is None else copied(ReservedView, kept)


@router.get("", responses=problems())
def list_benches(service: Service) -> list[BenchView]:
    """List every bench that a worker of this database has registered."""
    return [view_of(service, bench_id) for bench_id in service.benches.ids()]


@router.get("/{bench_id}", responses=problems(404))
def read_bench(bench_id: str, service: Service) -> BenchView:
    """Read one bench: live state, limits, declared accuracy, and the job that drives it."""
    return view_of(service, bench_id)


@router.get("/{bench_id}/queue", responses=problems(404))
def read_queue(bench_id: str, service: Service) -> QueueView:
    """List the jobs that wait for a bench, in the order in which they start, and why each of them waits."""
    queue = service.queues.queue(bench_id)
    holder = service.benches.holder(bench_id)
    places = queue.places(holder is not None)
    named = [entry.id for entry in queue.entries] + ([] if queue.running is None else [queue.running])
    numbers = service.stores.jobs.numbers(named)
    entries = [QueueEntryView.of(entry, places[entry.id], numbers.get(entry.id, 0)) for entry in queue.entries]
    running = None if queue.running is None else numbers.get(queue.running)
    return QueueView(
        bench=queue.bench, running=queue.running, running_number=running, driven_by=holder, entries=entries
    )


@router.post("/{bench_id}/stop", status_code=202, responses=problems(404, 413, 507))
async def stop(
    bench_id: str,
    service: Service,
    client: ClientName,
    sender: Sender,
    body: StopRequest | None = None,
    key: IdempotencyKey = None,
) -> Stopping:
    """Stop a bench by software: end the running job, stop the table, switch the unit off; until this stop is released.

    The stop goes to the bench itself first, on its host, and needs no database for that: a worker sees it, and in its
    place the bench's supervisor. The database follows when it can; `books` says why where it has not yet. Several stops
    of a bench can stand at the same time, sixteen at most: of one more, `books` says that it waits. Sent again within
    ten minutes with its Idempotency-Key it is the same stop, as long as this process lives.
    """
    asked = body or StopRequest.model_validate({})
    by = sender.name(asked.by) or client
    done = await stop_in_own_thread(service.stops, bench_id, asked.reason, by, key, wait=asked.wait)
    return Stopping(
        bench=bench_id, stop=done.stop.id, job=done.job, safety=SafetyView.of(done.safety), books=done.books or None
    )


@router.get("/{bench_id}/stops", responses=problems(404))
def list_stops(bench_id: str, service: Service, after: After = None, limit: Limit = 50) -> StopPage:
    """List every stop of a bench, newest first: standing and released ones, with author and reason of both."""
    service.benches.description(bench_id)
    page = service.stores.benches.stops(bench_id, after=after, limit=limit)
    return StopPage(items=[StopView.of(one) for one in page.items], next=page.next)


@router.post("/{bench_id}/stops/{stop_id}/release", responses=problems(404, 409, 413, 507), dependencies=[TeamOfBench])
def release_stop(
    bench_id: str, stop_id: str, service: Service, body: ReleaseRequest, sender: Sender, requested_by: RequestedBy
) -> Releasing:
    """Release one stop, the client's own or another's, once the bench is known to be safe.

    The person who releases it is the one who has logged in; without accounts, a name is given as `by` or in
    `X-Requested-By`. The jobs in the bench's queue continue once
    no stop stands.
    """
    by = sender.name(body.by) or requested_by
    if by is None:
        text = f"the person who releases a stop names himself, here or in {REQUESTED_BY}"
        raise RequestValidationError([{"type": "missing", "loc": ("body", "by"), "msg": text, "input": None}])
    released = service.stops.release(bench_id, stop_id, by, body.remark)
    standing = service.stores.benches.standing_stops(bench_id)
    return Releasing(stop=StopView.of(released), standing=[StopView.of(one) for one in standing])


@router.post("/{bench_id}/release", responses=problems(404, 409, 507), dependencies=[TeamOfBench])
def release(bench_id: str, service: Service, client: ClientName) -> BenchView:
    """Release the only stop of a bench that stands; where several stand, 409 with their ids.

    The bench must be known to be safe. The jobs that wait in its queue continue.
    """
    service.stops.release_only(bench_id, client, "")
    return view_of(service, bench_id)
