"""Implementations of the turntable's port, each with what a test must know and break."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from procedures.bench import Clock, Turntable
from simulators.served.table import FAULT
from simulators.world import WorldConfig, build
from tests.conformance.served import FACTOR, Served, axis, opened, served

IMPLEMENTATIONS = ("simulated", "acutrol")


@dataclass
class TableRig:
    """A table, its clock, and what stands behind it."""

    port: Turntable
    clock: Clock
    behind: Any
    """The simulated table, or the served bench."""

    @property
    def served(self) -> Served | None:
        """The served bench; None where the table is in process."""
        return self.behind if isinstance(self.behind, Served) else None

    def rates_deg_s(self) -> list[float]:
        """True rates of the axes."""
        if self.served is not None:
            return self.served.do(lambda bench: bench.table.read_rates_deg_s().tolist())
        return self.behind.read_rates_deg_s().tolist()

    def break_it(self) -> None:
        """A fault that stays until a person resets it."""
        if self.served is not None:
            self.served.do(lambda bench: [bench.table.open_interlock(k, FAULT) for k in range(3)])
        else:
            self.behind._fault = "the servo has failed"

    def demands(self) -> list[str] | None:
        """Demands that have come over the wire; None in process."""
        if self.served is None:
            return None
        return [r for r in self.served.requests("turntable") if ":demand:" in r and "?" not in r]


def acutrol(rig: Served, folder: Path, factor: float = FACTOR, **section: Any) -> Any:
    """The ACUTROL driver at a served table."""
    axes = {"outer": axis(1, 360.0, continuous=True), "middle": axis(2, 190.0), "inner": axis(3, 400.0)}
    given = {**axes, "after_demand_s": 0.0, **section}
    return opened("turntable", "acutrol", rig.numbers["turntable"], folder, factor, **given)


@contextmanager
def table(name: str, folder: Path, **section: Any) -> Iterator[TableRig]:
    """Open one implementation."""
    if name == "simulated":
        bench = build(WorldConfig())
        yield TableRig(bench.turntable, bench.clock, bench.turntable)
        return
    with served({"turntable": "acutrol"}) as behind:
        device = acutrol(behind, folder, **section)
        try:
            yield TableRig(device, device.clock, behind)
        finally:
            device.close()
