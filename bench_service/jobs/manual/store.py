"""Interface of the store of manual mode: leases and their demands. Every method is one transaction."""

from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from bench_service.model.manual import Answer, DemandState, ManualDemand, ManualLease
from bench_service.model.records import Idempotency, Page


@dataclass(frozen=True)
class LeaseNews:
    """A lease, its new demands and its bench's stops, read at one moment for the worker that runs it."""

    lease: ManualLease
    stopped: str
    """The reasons of the bench's standing stops; empty: none stands."""
    demands: tuple[ManualDemand, ...]
    """Accepted demands that no worker has begun, oldest first."""


class ManualStore(Protocol):
    """Store of the leases of manual mode and their demands, of all benches. Interface; the SQL is in `persistence`."""

    def begin(self, lease: ManualLease, idempotency: Idempotency | None = None) -> ManualLease:
        """Store a new lease; with a known key and the same fingerprint, return the one that it made.

        Raises `ManualRefused` while a job drives the bench, while it is stopped, or while another lease is active;
        `AlreadyReserved` where another holder's reservation of bench or unit holds; `IdempotencyConflict`.
        """
        ...

    def get(self, lease_id: str) -> ManualLease:
        """Return one lease by its id. Raises `NotFound`."""
        ...

    def open_on(self, bench: str) -> ManualLease | None:
        """Return the lease of a bench that has not ended, whether or not its time is over; None where there is none."""
        ...

    def list(self, *, bench: str | None = None, after: str | None = None, limit: int = 50) -> Page[ManualLease]:
        """Return one page of leases, of one bench or all, newest first."""
        ...

    def take(self, lease_id: str, at: datetime, process: str) -> ManualLease | None:
        """Store that this worker runs the lease from now on, and return it; None where it has ended, its time is over,
        or another worker took it.
        """
        ...

    def news(self, lease_id: str) -> LeaseNews:
        """Return what the lease's worker must know now. Raises `NotFound`."""
        ...

    def renew(self, lease_id: str, until: datetime, at: datetime) -> ManualLease:
        """Move a lease's end and return the lease. Raises `ManualRefused` where it has ended, `NotFound`."""
        ...

    def ask_end(self, lease_id: str, by: str, at: datetime) -> ManualLease:
        """Request a lease's end, and return the lease: it ends at once where no worker has taken it. One that has ended
        stays as it is.
        """
        ...

    def end(self, lease_id: str, at: datetime, because: str, safe: bool | None) -> None:
        """End a lease, with the reason and whether the bench is safe (`safe` None: not known); its open demands become
        stopped. A second end changes nothing.
        """
        ...

    def hear(self) -> None:
        """Raise the heartbeat count of every open lease, in the name of this process."""
        ...

    def demand(self, demand: ManualDemand, at: datetime) -> ManualDemand:
        """Store a demand; the one that its key made before is returned instead.

        Raises `IdempotencyConflict` for a key of another demand, `ManualRefused` where the lease does not live, where
        the bench is stopped, or where too many demands wait.
        """
        ...

    def get_demand(self, lease_id: str, key: str) -> ManualDemand:
        """Return the demand of a lease that was stored under a key. Raises `NotFound`."""
        ...

    def demands(self, lease_id: str, *, after: str | None = None, limit: int = 50) -> Page[ManualDemand]:
        """Return one page of the demands of a lease, newest first."""
        ...

    def answer(self, demand_id: str, state: DemandState, answer: Answer, at: datetime) -> None:
        """Store the state and answer of a demand; one that is over stays as it is."""
        ...
