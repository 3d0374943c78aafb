"""Names of workers that analyse: each a lease, by a file next to the SQLite file or an advisory lock of Postgres.

A lease ends with its process, so no clock of any machine decides whether a worker is alive. A name has a dot, which
the id of a bench cannot have.
"""

from dataclasses import dataclass

from bench_service.model.errors import BenchBusy, Overloaded
from bench_service.persistence.bench.lease import ANALYSES, BenchLease, acquire_lease, lease_holder
from bench_service.persistence.database import Database

MOST = 1000
"""Most workers on one database."""


@dataclass(frozen=True)
class LeasedName:
    """A worker's name that this process holds, with its lease. Implements `WorkerName`."""

    name: str
    lease: BenchLease

    def held(self) -> bool:
        """Return whether this process still holds the lease."""
        return self.lease.held()

    def release(self) -> None:
        """Release the lease of the name; another process may take it."""
        self.lease.release()


class SqlWorkerNames:
    """Names of workers by leases on SQLite or Postgres. Implements
    `bench_service.evidence.batches.runner.WorkerNames`.
    """

    def __init__(self, database: Database, database_url: str) -> None:
        self._database = database
        self._database_url = database_url

    def take(self) -> LeasedName:
        for number in range(1, MOST + 1):
            name = f"analyses.{number}"
            if self.alive(name):
                continue
            try:
                return LeasedName(name, acquire_lease(self._database_url, name, ANALYSES))
            except BenchBusy:  # another worker was faster
                continue
        raise Overloaded(f"{MOST} workers analyse on this database already, the most that may: end one of them first")

    def alive(self, name: str) -> bool:
        return lease_holder(self._database, self._database_url, name) is not None
