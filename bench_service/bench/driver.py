"""Interface of a bench's driver, which opens the devices of a bench for a job, and of the lease on a bench."""

from dataclasses import dataclass
from typing import Any, Protocol

from bench_service.bench.devices import BenchDevices
from procedures.bench import Bench, BenchDescription, BenchNeeds
from procedures.core.unit import Unit


@dataclass(frozen=True)
class TrueTriad:
    """The true values of a simulated triad in one launch: ``U = bias + matrix·v`` in the nominal output's unit."""

    triad: str
    output_unit: str
    bias: tuple[float, ...]
    matrix: tuple[tuple[float, ...], ...]


class Lease(Protocol):
    """The right to drive a bench, held by one process until it ends or loses the lease. Interface;
    `persistence/bench/lease.py` has it on SQLite and Postgres.
    """

    def held(self) -> bool:
        """Return whether this process still holds the lease. Asks the file system or the database."""
        ...

    def regain(self) -> bool:
        """Try to take a lost lease again; return False where another process has it, or the database does not
        answer.
        """
        ...

    def release(self) -> None:
        """Release the lease; a second call does nothing."""
        ...


class BenchDriver(BenchDevices, Protocol):
    """The devices of one bench as a job needs them: `open` is called once per job, and again after a restart.
    Interface; `drivers` implements it for simulated and real devices.
    """

    @property
    def description(self) -> BenchDescription: ...

    def mounted(self, serial: str | None = None) -> tuple[Unit, ...]:
        """Return the units that this bench can test, as declared; a simulated bench makes one for a `serial` that is
        asked for.
        """
        ...

    def open(
        self,
        unit: str,
        seed: int | None,
        checkpoint: dict[str, Any] | None,
        needs: BenchNeeds,
        job: str | None = None,
    ) -> Bench:
        """The bench with a unit on it, for a job; from a checkpoint, a simulated world continues where it was.

        The bench has the devices' links until `Bench.close`. Raises `NotMounted`, `DeviceBusy`, `BenchError`.

        `seed`: of simulated devices, None: 0. `checkpoint` None: a new world. `job`: id of the job that takes the link,
        None outside of jobs.
        """
        ...

    def warm_up(self) -> None:
        """Load, while no job runs, what a device of the first job would otherwise load during a demand."""
        ...

    def truth(self, unit: str, seed: int) -> tuple[TrueTriad, ...]:
        """Return the true values of a simulated unit in a job with this seed, one a triad; empty on a real bench."""
        ...
