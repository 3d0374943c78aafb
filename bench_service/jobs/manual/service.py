"""Manual mode for clients: a lease on an idle bench, its demands, its end."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

from bench_service.bench.directory import BenchDirectory
from bench_service.jobs.manual.demands import checked
from bench_service.jobs.queue_service import QueueService
from bench_service.jobs.stores import JobStores
from bench_service.mapping import copied
from bench_service.model.errors import NotAllowed, NotDriving, NotFound, NotMounted
from bench_service.model.manual import DemandKind, ManualDemand, ManualLease
from bench_service.model.records import Idempotency, Page
from bench_service.wall_clock import new_id, now
from procedures.core.errors import BadParameter

LONGEST_MIN = 240.0
"""Longest time of a lease from now on [min]; renewing gives another one."""


@dataclass(frozen=True)
class ManualRequest:
    """A client's request for manual mode: bench, unit, holder, reason, duration."""

    bench: str
    unit: str | None
    """Serial of the unit on the table; None: the first one that the bench has."""
    holder: str
    proven: bool
    reason: str
    minutes: float
    reservation: str | None


class ManualService:
    """Operations of clients on leases of manual mode, on all benches; each bench's worker carries them out
    (`bench_service.jobs.manual.runner`).
    """

    def __init__(
        self, stores: JobStores, benches: BenchDirectory, queues: QueueService, wake: Callable[[str], None]
    ) -> None:
        """Set up with `wake`, which has the worker of a bench look at its lease."""
        self._stores, self._benches, self._queues, self._wake = stores, benches, queues, wake

    def begin(self, request: ManualRequest, idempotency_key: str | None = None) -> ManualLease:
        """Begin manual mode on an idle bench.

        Raises `NotFound`, `NotMounted`, `BadParameter`, `NotDriving` where no worker drives the bench, `ManualRefused`
        and `AlreadyReserved` where something else has it, `IdempotencyConflict`.
        """
        units = [unit.serial for unit in self._benches.mounted(request.bench, request.unit)]
        unit = request.unit or next(iter(units), None)
        if unit is None or unit not in units:
            raise NotMounted(f"bench {request.bench!r} has no unit {unit!r}; it has {', '.join(units) or 'none'}")
        if request.reservation is not None:
            self._queues.usable(request.reservation, request.bench, unit)
        if not self._benches.driven(request.bench):
            raise NotDriving(
                f"no worker drives bench {request.bench} now, and manual mode needs one: start `bench worker`"
            )
        at = now()
        until = at + timedelta(minutes=_minutes(request.minutes))
        lease = copied(ManualLease, request, id=new_id(), unit=unit, created_at=at, until=until)
        key = Idempotency.of("manual", idempotency_key, request)
        begun = self._stores.manual.begin(lease, key)
        self._wake(request.bench)
        return begun

    def lease(self, bench_id: str, lease_id: str) -> ManualLease:
        """Return a lease of a bench. Raises `NotFound`, also for a lease of another bench."""
        found = self._stores.manual.get(lease_id)
        if found.bench != bench_id:
            raise NotFound("manual lease", lease_id, f"it is one of bench {found.bench}")
        return found

    def on(self, bench_id: str) -> ManualLease | None:
        """Return the open lease of a bench; None where it is not in manual mode. Raises `NotFound` for an unknown
        bench.
        """
        self._benches.description(bench_id)
        return self._stores.manual.open_on(bench_id)

    def leases(self, bench_id: str, after: str | None, limit: int) -> Page[ManualLease]:
        """Return one page of the leases of a bench, newest first. Raises `NotFound` for an unknown bench."""
        self._benches.description(bench_id)
        return self._stores.manual.list(bench=bench_id, after=after, limit=limit)

    def renew(self, bench_id: str, lease_id: str, minutes: float, holder: str) -> ManualLease:
        """Set the end of a lease to some minutes from now, and return the lease. Raises `NotAllowed` for another than
        its holder, `ManualRefused` once it has ended.
        """
        _require_holder(self.lease(bench_id, lease_id), holder)
        at = now()
        renewed = self._stores.manual.renew(lease_id, at + timedelta(minutes=_minutes(minutes)), at)
        self._wake(bench_id)
        return renewed

    def end(self, bench_id: str, lease_id: str, by: str) -> ManualLease:
        """End a lease, one's own or another's: the bench is made safe. One that has ended stays as it is."""
        self.lease(bench_id, lease_id)
        ended = self._stores.manual.ask_end(lease_id, by, now())
        self._wake(bench_id)
        return ended

    def demand(
        self, bench_id: str, lease_id: str, kind: DemandKind, values: Mapping[str, Any], holder: str, key: str | None
    ) -> ManualDemand:
        """Accept a demand within the bench's limits; the worker carries it out.

        Raises `BadParameter` with field, value and range, `NotAllowed` for another than the lease's holder,
        `ManualRefused` once the lease has ended and while the bench is stopped, `IdempotencyConflict`.
        """
        lease = self.lease(bench_id, lease_id)
        _require_holder(lease, holder)
        given = checked(kind, values, self._benches.description(bench_id))
        at, new = now(), new_id()
        demand = ManualDemand(new, lease.id, key or new, kind, given, holder, at)
        accepted = self._stores.manual.demand(demand, at)
        self._wake(bench_id)
        return accepted

    def demand_of(self, bench_id: str, lease_id: str, key: str) -> ManualDemand:
        """Return the demand that was stored under a key, with its state and answer. Raises `NotFound`."""
        return self._stores.manual.get_demand(self.lease(bench_id, lease_id).id, key)

    def demands(self, bench_id: str, lease_id: str, after: str | None, limit: int) -> Page[ManualDemand]:
        """Return one page of the demands of a lease, newest first. Raises `NotFound`."""
        return self._stores.manual.demands(self.lease(bench_id, lease_id).id, after=after, limit=limit)


def _minutes(minutes: float) -> float:
    if not 0.0 < minutes <= LONGEST_MIN:
        raise BadParameter("minutes", minutes, f"above 0 and at most {LONGEST_MIN:g}")
    return minutes


def _require_holder(lease: ManualLease, name: str) -> None:
    """Check that the holder asks: two people at one table would not know of each other's demands."""
    if lease.holder != name:
        raise NotAllowed(
            f"lease {lease.id} is {lease.holder}'s, not {name}'s: only its holder may command the bench; anybody "
            "with the right to operate may end the lease, and everybody may stop the bench"
        )
