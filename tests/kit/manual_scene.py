"""A simulated bench in manual mode whose table is made safe as slowly as a test wants, and its demands."""

from collections.abc import Callable
from datetime import timedelta
from threading import Event
from typing import Any, cast

from bench_service.bench.live.values import LiveBoard
from bench_service.jobs.manual.session import ManualSession
from bench_service.model.manual import Answer, DemandKind, DemandState, ManualDemand, ManualLease
from bench_service.wall_clock import now, pause_async
from procedures.bench import Bench
from procedures.bench.errors import Disconnected
from simulators.world import WorldConfig, build

VALUES: dict[str, dict[str, Any]] = {
    "supply_on": {"voltage_v": None, "current_a": None},
    "rate": {"axis": "outer", "rate_deg_s": 5.0, "duration_s": 100.0, "ramp_s": 1.0},
    "go_to": {"outer_deg": 5.0, "middle_deg": None, "inner_deg": None},
    "halt": {},
}
LONG_S = 20.0
"""Longest wait for an event; none is waited for in vain."""


def a_lease(minutes: float = 5.0) -> ManualLease:
    at = now()
    return ManualLease("l1", "sim", "SIM-0001", "ann", False, "a look", at, at + timedelta(minutes=minutes))


def a_demand(kind: DemandKind, name: str = "") -> ManualDemand:
    return ManualDemand(name or kind, "l1", name or kind, kind, VALUES[kind], "ann", now())


class Gate:
    """Keeps a verb of a device from going on until it is let through."""

    def __init__(self, verb: Callable[..., Any]) -> None:
        self._verb = verb
        self.entered, self.open = Event(), Event()
        self.ended = Event()

    async def __call__(self, *arguments: Any) -> Any:
        self.entered.set()
        try:
            while not self.open.is_set():
                await pause_async(0.005)
            return await self._verb(*arguments)
        finally:
            self.ended.set()


class Scene:
    """A bench with a table that is made safe slowly, the commands that reached it, and the outcomes of demands."""

    def __init__(self) -> None:
        self.bench: Bench = build(WorldConfig(real_time_factor=20.0, wait=pause_async))
        self.table = self.bench.turntable
        self.brake = Gate(self.table.make_safe)
        setattr(self.table, "make_safe", self.brake)  # noqa: B010
        self.commanded: list[str] = []
        for device, verb in ((self.bench.supply, "switch_on"), (self.table, "command_rate"), (self.table, "move_to")):
            setattr(device, verb, self._noted(verb, getattr(device, verb)))
        self.outcomes: dict[str, tuple[DemandState, Answer]] = {}
        self._news = Event()

    def _noted(self, verb: str, work: Callable[..., Any]) -> Callable[..., Any]:
        async def noted(*arguments: Any) -> Any:
            self.commanded.append(verb)
            return await work(*arguments)

        return noted

    def tell(self, demand: ManualDemand, state: DemandState, answer: Answer) -> None:
        self.outcomes[demand.id] = (state, answer)
        self._news.set()

    def session(self, lease: ManualLease, **more: Any) -> ManualSession:
        board = LiveBoard(cast("Any", None), "sim")
        return ManualSession(lease, self.bench, lambda: False, board, self.tell, **more)

    def over(self, name: str) -> tuple[DemandState, Answer]:
        """Outcome of a demand, once nothing more becomes of it."""
        while name not in self.outcomes or not self.outcomes[name][0].over:
            assert self._news.wait(LONG_S), name
            self._news.clear()
        return self.outcomes[name]


async def silent() -> None:
    raise Disconnected("no answer")
