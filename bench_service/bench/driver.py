"""PORT to the machine: opens the devices of a bench by the bench's name."""

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
    """The right to drive a bench, held for a process's life unless it is lost."""

    def held(self) -> bool:
        """Return whether this process still holds the lease."""
        ...

    def regain(self) -> bool:
        """Take a lost lease again; False where another process has it, or the database does not answer."""
        ...

    def release(self) -> None:
        """Release the lease; a second call does nothing."""
        ...


class BenchDriver(BenchDevices, Protocol):
    """The devices of one bench. `open` is called once per job, and again after a restart."""

    @property
    def description(self) -> BenchDescription: ...

    def mounted(self, serial: str | None = None) -> tuple[Unit, ...]:
        """The units that this bench can test, as declared; a simulated bench mounts some by their serial."""
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
        """
        ...

    def warm_up(self) -> None:
        """Load, while no job runs, what a device of the first job would otherwise load during a demand."""
        ...

    def truth(self, unit: str, seed: int) -> tuple[TrueTriad, ...]:
        """The true values of a simulated unit in a job with this seed; empty on a real bench."""
        ...
