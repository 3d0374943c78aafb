"""Queues and reservations for clients: a job's place, and reserving a bench or a unit."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from bench_service.bench.directory import BenchDirectory
from bench_service.jobs.queue import BenchQueue, Place
from bench_service.jobs.reservation import Reservation, Reserved
from bench_service.jobs.stores import JobStores
from bench_service.mapping import copied
from bench_service.model.errors import NotFound
from bench_service.model.job import Job, JobState
from bench_service.model.records import Idempotency
from bench_service.wall_clock import new_id, now
from procedures.core.errors import BadParameter

LONGEST = timedelta(days=90)
"""Longest time ahead at which a reservation may end."""


@dataclass(frozen=True)
class ReservationRequest:
    """A client's request for a reservation: what, for whom, until when."""

    kind: Reserved
    name: str
    holder: str
    until: datetime | None
    minutes: float | None
    """Duration from now, where no end is given [min]."""
    note: str = ""
    team: str = ""


@dataclass(frozen=True)
class Standing:
    """Place of a queued job, and the sentence that says why it does not run."""

    place: Place | None = None
    waiting: str | None = None


class QueueService:
    """Operations of clients on queues and reservations, on all benches."""

    def __init__(self, stores: JobStores, benches: BenchDirectory, wake: Callable[[str], None]) -> None:
        """Set up with `wake`, called for each bench on which a waiting job may now start."""
        self._stores = stores
        self._wake = wake
        self._benches = benches

    def queue(self, bench_id: str) -> BenchQueue:
        """Return a bench's queue now. Raises `NotFound` for an unknown bench."""
        return self._stores.queue.look(self._benches.description(bench_id).id, now())

    def standing(self, jobs: Sequence[Job]) -> dict[str, Standing]:
        """Return place and reason of each of these jobs, by job id; each bench's queue is read once."""
        places: dict[str, Place] = {}
        for bench in {job.bench for job in jobs if job.state is JobState.QUEUED}:
            places |= self._stores.queue.look(bench, now()).places(self._benches.driven(bench))
        return {job.id: _standing(job, places.get(job.id)) for job in jobs}

    def reserve(self, request: ReservationRequest, idempotency_key: str | None = None) -> Reservation:
        """Store a reservation of a bench or a unit, and return it. Raises `NotFound` for one that is unknown,
        `AlreadyReserved`, `BadParameter`.
        """
        at = now()
        until = request.until or at + timedelta(minutes=request.minutes or 0.0)
        if not at < until <= at + LONGEST:
            allowed = f"after now, {at.isoformat()}, and at most {LONGEST.days} days later"
            raise BadParameter("until", until.isoformat(), allowed)
        if request.kind is Reserved.BENCH:
            self._benches.description(request.name)
        else:
            self._stores.units.unit(request.name)
        made = copied(Reservation, request, id=new_id(), created_at=at, until=until)
        key = Idempotency.of("reservations", idempotency_key, request)
        return self._stores.reservations.add(made, key)

    def give_back(self, reservation_id: str) -> Reservation:
        """End a reservation early, return it, and wake the benches whose jobs waited for it. Raises `NotFound`."""
        kept = self._stores.reservations.end(reservation_id, now())
        for bench_id in (kept.name,) if kept.kind is Reserved.BENCH else self._benches.ids():
            self._wake(bench_id)
        return kept

    def team_of(self, reservation_id: str | None) -> str:
        """The team of a reservation; empty where there is none, or everybody acts on it."""
        if reservation_id is None:
            return ""
        try:
            return self._stores.reservations.get(reservation_id).team
        except NotFound:
            return ""

    def team_of_bench(self, bench_id: str) -> str:
        """Return the team that has reserved a bench now; empty: none has."""
        held = self._stores.queue.look(bench_id, now()).reservations
        return next((r.team for r in held if (r.kind, r.name) == (Reserved.BENCH, bench_id)), "")

    def usable(self, reservation_id: str, bench: str, unit: str) -> None:
        """Refuse a reservation that is over, or is for another bench or unit. Raises `BadParameter`."""
        try:
            found = self._stores.reservations.get(reservation_id)
        except NotFound:
            raise BadParameter("reservation", reservation_id, "the id of a reservation that is active now") from None
        if not found.active(now()):
            ended = f"one that holds now: this one ended at {found.over_at.isoformat()}"
            raise BadParameter("reservation", reservation_id, ended)
        if found.name != {Reserved.BENCH: bench, Reserved.UNIT: unit}[found.kind]:
            allowed = f"one of bench {bench} or unit {unit}: this one is of {found.kind.value} {found.name}"
            raise BadParameter("reservation", reservation_id, allowed)


def _standing(job: Job, place: Place | None) -> Standing:
    if job.state is JobState.PAUSED:
        return Standing(waiting="paused until a person resumes it")
    if job.state is JobState.INTERRUPTED:
        return Standing(waiting="the service could not continue it; it waits until a person resumes it")
    if job.state is JobState.RUNNING and job.prompt is not None:
        return Standing(waiting=f"a person at the bench is asked: {job.prompt.get('text', '')}")
    return Standing(place, None if place is None else place.waiting)
