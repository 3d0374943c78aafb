"""Implementations of the chamber's port, each with what a test must know and break."""

import asyncio
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from procedures.bench import Chamber, Clock
from simulators.chamber.device import SimChamber
from simulators.truth.thermal import ChamberTruth, UnitThermalTruth
from tests.conformance.served import CHAMBER_LIMITS, FACTOR, Served, opened, served

IMPLEMENTATIONS = ("simulated", "simserv", "ascii2", "modbus")
REGISTERS = {
    "actual": {"address": 0},
    "set_point": {"address": 2},
    "ramp": {"address": 4},
    "running": {"address": 6, "bit": 0},
    "door": {"address": 6, "bit": 1},
    "alarm": {"address": 6, "bit": 2},
}
RUNNING, DOOR, ALARM = 1, 2, 4
SECTIONS: dict[str, dict[str, Any]] = {
    "simserv": {"door_input": "Door open", "after_set_s": 0.0},
    "ascii2": {"door_bit": 30, "alarm_bit": 31, "after_set_s": 0.0},
    "modbus": {"registers": REGISTERS},
}
SETS = ("11001", "11068", "11072", "14001", "$01E", "$01U")


class _Ticking:
    """Clock of a chamber alone."""

    def __init__(self) -> None:
        self.ticks = 0
        self.chamber = SimChamber(ChamberTruth(), UnitThermalTruth(), 1, 10.0, self.now_s)

    def now_s(self) -> float:
        return self.ticks / 10.0

    async def sleep(self, seconds: float) -> None:
        self.chamber.advance(round(10.0 * seconds))
        self.ticks += round(10.0 * seconds)


@dataclass
class ChamberRig:
    """A chamber, its clock, and what stands behind it."""

    name: str
    port: Chamber
    clock: Clock
    behind: Any

    def do(self, change: Any) -> None:
        """Change the simulated chamber behind the port."""
        if isinstance(self.behind, Served):
            self.behind.do(lambda bench: change(bench.bench.chamber))
        else:
            change(self.behind)

    def sets(self) -> list[str]:
        """Requests over the wire that change something."""
        if not isinstance(self.behind, Served):
            return []
        return [r for r in self.behind.requests("chamber") if r.startswith(SETS)]


@contextmanager
def chamber(name: str, folder: Path, bits: int = 0, factor: float = FACTOR, **section: Any) -> Iterator[ChamberRig]:
    """Open one implementation; `bits`: the first state of a Modbus chamber."""
    if name == "simulated":
        ticking = _Ticking()
        yield ChamberRig(name, ticking.chamber, ticking, ticking.chamber)
        return
    given = {"limits": CHAMBER_LIMITS, **SECTIONS[name], **section}
    if name == "modbus":
        with _modbus_server(bits) as port:
            device = opened("chamber", name, port, folder, **given)
            yield ChamberRig(name, device, device.clock, None)
            device.close()
        return
    with served({"chamber": "simserv"}, thermal=True, factor=factor) as behind:
        device = opened("chamber", name, behind.numbers["chamber"], folder, factor, **given)
        try:
            yield ChamberRig(name, device, device.clock, behind)
        finally:
            device.close()


@contextmanager
def _modbus_server(bits: int) -> Iterator[int]:
    script = Path(__file__).with_name("modbus_server.py")
    with subprocess.Popen([sys.executable, str(script), str(bits)], stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            yield int(server.stdout.readline())
        finally:
            server.kill()


def run(scene: Any) -> None:
    """Run a scene to its end."""
    asyncio.run(scene)
