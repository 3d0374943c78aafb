"""Faults of a served bench at random times, and the person who puts right what needs one."""

from collections import Counter
from random import Random
from typing import Any

from bench_service.wall_clock import monotonic_s
from simulators.served.faults import Fault
from tests.conformance.served import Served

LINES = ("turntable", "chamber", "supply")
ANSWERS = ("slow", "half", "doubled", "cut", "cut_after", "silent")
FRAMES = ("wrong_crc", "lost_counter", "invalid", "half")
BROKEN = (
    ("turntable", "stuck_sensor"),
    ("turntable", "interlock"),
    ("supply", "trip"),
    ("chamber", "trip"),
    ("chamber", "door"),
)
PERSON_S = 4.0
"""Time after which a person has put a device right [s]."""
LATE_S = 1.5
"""Delay of a slow answer [s]."""


class Faults:
    """A Poisson process of faults over all kinds, each as likely."""

    def __init__(self, behind: Served, chance: Random, mean_s: float) -> None:
        self._behind, self._chance, self._mean_s = behind, chance, mean_s
        self._kinds = [
            *((device, kind) for device in LINES for kind in ANSWERS),
            *(("unit_link", kind) for kind in FRAMES),
            *BROKEN,
            *((device, "line pulled out") for device in (*LINES, "unit_link")),
        ]
        self._next_s = monotonic_s() + self._pause_s()
        self._right_s: float | None = None
        self.made: Counter[str] = Counter()
        self.times: list[float] = []
        """Moments of the faults."""

    def step(self) -> None:
        """Make a fault whose time has come, and put right an earlier one."""
        now_s = monotonic_s()
        if self._right_s is not None and now_s > self._right_s:
            self.put_right()
        if now_s < self._next_s:
            return
        self._next_s = now_s + self._pause_s()
        device, kind = self._chance.choice(self._kinds)
        self.made[f"{device} {kind}"] += 1
        self.times.append(now_s)
        self._behind.do(lambda bench: self._make(bench, device, kind))

    def put_right(self) -> None:
        """A person resets, closes and switches back what is broken; nothing where all is right."""
        self._right_s = None
        self._behind.do(_mended)

    def told(self) -> str:
        """Number of the faults, and each kind with its own."""
        kinds = ", ".join(f"{count} × {name}" for name, count in sorted(self.made.items()))
        return f"{self.made.total()}: {kinds}"

    def _pause_s(self) -> float:
        return self._chance.expovariate(1.0 / self._mean_s)

    def _make(self, bench: Any, device: str, kind: str) -> None:
        if kind == "line pulled out":
            bench.ports[device].cut()
            return
        if (device, kind) in BROKEN:
            self._right_s = monotonic_s() + PERSON_S
            bench.break_now(Fault(device, kind))
            return
        coming = bench.plan.sent.get(device, 0) + self._chance.randint(1, 8)
        bench.plan.faults = (Fault(device, kind, at=coming, seconds=LATE_S),)


def _mended(bench: Any) -> None:
    table, chamber = bench.table, bench.bench.chamber
    table.stuck_deg = None
    table.reset_interlocks()
    for axis in range(3):
        table.close_interlock(axis)
    bench.bench.supply._tripped = False
    if chamber is not None:
        chamber.set_door(False)
        chamber.reset_limiter()
