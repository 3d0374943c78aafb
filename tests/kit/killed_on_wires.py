"""A driving process on wires that is killed with SIGKILL in a motion of its table or in a ramp of its chamber.

The devices are served simulators of the caller's process, whose world is the witness.
"""

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench_service.drivers.device_register import DeviceRegister
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.wall_clock import monotonic_s
from tests.chaos.journals import NOTICED
from tests.conformance.served import Served, served
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.wired_bench import AMBIENT_C, LANGUAGES, THERMAL_LANGUAGES, bench_file

AT_REST_DEG_S = 0.01
"""Rate above which the table moves. One that a controller holds is servoed and not locked."""
MANUAL = "/api/v1/benches/east/manual"
DEMANDS: dict[str, dict[str, Any]] = {
    "go_to": {"middle_deg": 170.0},
    "rate": {"axis": "outer", "rate_deg_s": 40.0, "duration_s": 600.0},
    "chamber": {"temperature_c": 60.0, "ramp_c_min": 3.0},
}
FACTORS = {"go_to": 4.0, "rate": 4.0, "chamber": 20.0}
"""Time factors: a chamber's ramp of 3 K/min is slow."""
FAST_DEG_S, RISEN_C = 30.0, 0.5
"""Rate of the table, and rise of the chamber's air, at which the process is killed."""


@dataclass(frozen=True)
class World:
    """True state of the served world."""

    rate_deg_s: float
    powered: bool
    air_c: float
    target_c: float | None
    """Temperature that the chamber is commanded to; None: it is switched off, or there is none."""

    @property
    def under_way(self) -> bool:
        """True in the midst of a motion or of a ramp."""
        ramps = self.target_c is not None and self.target_c != AMBIENT_C and self.air_c > AMBIENT_C + RISEN_C
        return self.rate_deg_s > FAST_DEG_S or ramps

    @property
    def safe(self) -> bool:
        """True where the table rests, the unit is off and the chamber is commanded to ambient."""
        return self.rate_deg_s < AT_REST_DEG_S and not self.powered and self.target_c in (None, AMBIENT_C)


@dataclass(frozen=True)
class Killed:
    """Outcome of one kill, and the bench, whose service can be started again."""

    to_safe_s: float
    """From the kill to safe by read-back, as the register has it."""
    noticed_s: float
    """From the supervisor's notice to that, by its own words."""
    world: World
    bench: BenchProcess
    lease: str
    """Path of the lease that the process drove."""

    def __str__(self) -> str:
        return f"kill to safe {self.to_safe_s:.3f} s, notice to safe {self.noticed_s:.3f} s, {self.world}"


@contextmanager
def killed_in(kind: str, database_url: str, folder: Path, port: int) -> Generator[Killed]:
    """Drive a bench by manual mode, kill its process in the midst of `kind`, and wait for the supervisor."""
    thermal, factor = kind == "chamber", FACTORS[kind]
    with served(THERMAL_LANGUAGES if thermal else LANGUAGES, thermal=thermal, factor=factor) as behind:
        file = bench_file(folder, behind, factor)
        bench = BenchProcess(database_url, port, folder, file=str(file))
        bench.register, bench.files = DeviceRegister(folder, "east"), HostFiles(folder, "east")
        try:
            bench.start()
            bench.supervised()
            lease = _demanded(bench, kind)
            bench.until(lambda: _world(behind).under_way, 60)
            killed_s = monotonic_s()
            bench.kill()
            bench.until(lambda: bench.state().safe, 20)
            to_safe_s, world = monotonic_s() - killed_s, _world(behind)
            bench.until(lambda: _noticed(folder) is not None, 10)
            noticed_s = _noticed(folder)
            assert noticed_s is not None
            yield Killed(to_safe_s, noticed_s, world, bench, lease)
        finally:
            bench.end()


def ask_for_lease(bench: BenchProcess) -> str:
    """Ask for a lease of manual mode; return its path."""
    lease = bench.client.post(MANUAL, json={"reason": "a look", "by": "ann", "unit": "GL017"})
    assert lease.status_code == 201, lease.text
    return f"{MANUAL}/{lease.json()['id']}"


def _demanded(bench: BenchProcess, kind: str) -> str:
    """Switch the unit on and demand `kind`; the path of the lease."""
    path = ask_for_lease(bench)

    def ask(**body: Any) -> str:
        made = bench.client.post(f"{path}/demands", json={**body, "by": "ann"})
        assert made.status_code == 202, made.text
        return made.json()["key"]

    key = ask(kind="supply_on")
    bench.until(lambda: bench.client.get(f"{path}/demands/{key}").json()["state"] == "done", 60)
    ask(kind=kind, **DEMANDS[kind])
    return path


def _noticed(folder: Path) -> float | None:
    """Time from notice to safe [s], from what the supervisor has written; None before it has."""
    for file in (*folder.rglob("*.log"), *folder.rglob("*.out")):
        found = NOTICED.search(file.read_text(errors="replace"))
        if found is not None:
            return float(found[1])
    return None


def _world(behind: Served) -> World:
    def look(bench: Any) -> World:
        rate = float(np.max(np.abs(bench.bench.turntable.read_rates_deg_s())))
        powered, chamber = bench.bench.supply.is_on(), bench.bench.chamber
        if chamber is None:
            return World(rate, powered, AMBIENT_C, None)
        state = chamber.plant.state
        return World(rate, powered, float(state.control_reading_c), state.target_c)

    return behind.do(look)
