"""A lease of manual mode that is being left: no demand reaches a device while, or after, the bench is made safe.

The bench is a simulated one whose table takes as long to be made safe as the test wants, so every demand comes during
that. Waits have no share in what is found: each is for an event of the session's own thread.
"""

import asyncio
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from threading import Event, Thread
from types import SimpleNamespace
from typing import Any, cast

import pytest

from bench_service.bench.devices import DeviceState
from bench_service.bench.driven import ShuttingDown
from bench_service.bench.live.values import LiveBoard
from bench_service.drivers.device_register import DeviceRegister
from bench_service.jobs.manual.reader import LeaseReader
from bench_service.jobs.manual.runner import ManualRunner
from bench_service.jobs.manual.session import ManualSession
from bench_service.jobs.manual.store import LeaseNews, ManualStore
from bench_service.model.manual import Answer, DemandKind, DemandState, ManualDemand, ManualLease
from bench_service.wall_clock import now, pause_async
from procedures.bench import Bench
from procedures.bench.errors import BenchError, Disconnected, Stopped
from simulators.world import WorldConfig, build
from tests.kit.failing_driver import FailingDriver

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


@pytest.fixture
def scene() -> Generator[Scene]:
    made = Scene()
    yield made
    made.brake.open.set()


def _passed(session: ManualSession) -> None:
    """Let the session's thread do whatever is in its loop now."""
    asyncio.run_coroutine_threadsafe(pause_async(0.0), session._loop).result(LONG_S)


def _safely(session: ManualSession) -> Thread:
    """The road to safety, in a thread of its own."""
    thread = Thread(target=session.make_safe)
    thread.start()
    return thread


ENDS: dict[str, Callable[[ManualSession], object]] = {
    "a stop": lambda session: session.stop(),
    "a shutdown": lambda session: session.shut_down(),
    "an end": lambda session: session.leave("ended by bob"),
    "a lost device": lambda session: setattr(session._bench.chamber or session._bench.supply, "read", _silent),
    "its time": lambda session: session.expires(replace(session.lease, until=now())),
}
WORDS = {
    "a stop": "stopped by an operator",
    "a shutdown": "the service ended",
    "an end": "ended by bob",
    "a lost device": "no answer",
    "its time": "its time has ended",
}


async def _silent() -> None:
    raise Disconnected("no answer")


@pytest.mark.parametrize("end", ENDS)
def test_no_demand_begins_once_the_bench_is_being_made_safe(scene: Scene, end: str) -> None:
    session = scene.session(a_lease())

    def hold() -> None:
        with suppress(Stopped, Disconnected, ShuttingDown):
            session.hold()

    holding = Thread(target=hold)
    holding.start()
    ENDS[end](session)
    holding.join(LONG_S)
    road = _safely(session)
    assert scene.brake.entered.wait(LONG_S)
    for kind in ("supply_on", "rate", "go_to"):
        session.demand(a_demand(cast("DemandKind", kind)))
    _passed(session)
    scene.brake.open.set()
    road.join(LONG_S)
    _passed(session)
    session.demand(a_demand("supply_on", "after"))
    _passed(session)
    session.close()
    assert scene.commanded == []
    for name in ("supply_on", "rate", "go_to", "after"):
        state, answer = scene.over(name)
        assert state is DemandState.STOPPED
        assert answer.text == f"the lease has ended: {WORDS[end]}; nothing was commanded"


def test_no_demand_begins_between_a_stop_and_the_making_safe(scene: Scene) -> None:
    session = scene.session(a_lease())
    session.stop()
    session.demand(a_demand("supply_on"))
    _passed(session)
    assert scene.commanded == []
    scene.brake.open.set()
    session.make_safe()
    session.close()


def test_no_demand_begins_while_a_stop_stands_on_the_channel(scene: Scene) -> None:
    session = scene.session(a_lease(), stop_stands=lambda: True)
    session.demand(a_demand("supply_on"))
    assert scene.over("supply_on")[1].text.startswith("the lease has ended: stopped by an operator")
    assert scene.commanded == []
    scene.brake.open.set()
    session.make_safe()
    session.close()


def test_a_demand_that_had_no_step_yet_is_left_with_an_outcome(scene: Scene) -> None:
    session = scene.session(a_lease())

    async def begun_and_left() -> None:
        session._begin(a_demand("supply_on"))
        await session._leave()

    asyncio.run_coroutine_threadsafe(begun_and_left(), session._loop).result(LONG_S)
    assert scene.over("supply_on")[0] is DemandState.STOPPED
    assert scene.commanded == []
    scene.brake.open.set()
    session.make_safe()
    session.close()


def test_a_closing_session_leaves_its_demands_before_the_links_are_given_back(scene: Scene) -> None:
    order: list[str] = []
    supply = Gate(scene.bench.supply.switch_on)
    setattr(scene.bench.supply, "switch_on", supply)  # noqa: B010
    setattr(scene.bench, "close", lambda: order.append("links given back"))  # noqa: B010
    tell = scene.tell
    session = scene.session(a_lease())
    session._tell = lambda demand, state, answer: (order.append(state.value), tell(demand, state, answer))
    session.demand(a_demand("supply_on"))
    assert supply.entered.wait(LONG_S)
    session.close()
    assert order == ["doing", "stopped", "links given back"]


def test_no_motion_begins_while_a_halt_brakes_the_table(scene: Scene) -> None:
    session = scene.session(a_lease())
    session.demand(a_demand("halt"))
    assert scene.brake.entered.wait(LONG_S)
    session.demand(a_demand("go_to"))
    state, answer = scene.over("go_to")
    assert (state, answer.field, answer.text.startswith("a halt is under way")) == (DemandState.REFUSED, "kind", True)
    assert scene.commanded == []
    scene.brake.open.set()
    assert scene.over("halt")[0] is DemandState.DONE
    _passed(session)
    session.demand(a_demand("go_to", "then"))
    assert scene.over("then")[0] is DemandState.DONE
    session.make_safe()
    session.close()


class Books:
    """A lease in memory: what its reader and its runner use of `ManualStore`, and stops of the bench."""

    def __init__(self, lease: ManualLease) -> None:
        self.lease = lease
        self.demands: tuple[ManualDemand, ...] = ()
        self.answers: dict[str, DemandState] = {}
        self.looks, self.look = 0, Event()
        self.end_of: tuple[str, bool | None] | None = None
        self.stops: list[str] = []

    def take(self, lease_id: str, at: Any, process: str) -> ManualLease:
        return self.lease

    def news(self, lease_id: str) -> LeaseNews:
        self.looks += 1
        self.look.set()
        self.lease = replace(self.lease, heard=self.lease.heard + 1)
        return LeaseNews(self.lease, "", self.demands)

    def answer(self, demand_id: str, state: DemandState, answer: Answer, at: Any) -> None:
        self.answers[demand_id] = state

    def end(self, lease_id: str, at: Any, because: str, safe: bool | None) -> None:
        self.end_of = (because, safe)

    def stop_bench_once(self, stop: Any) -> None:
        self.stops.append(stop.reason)

    def looked_at(self, times: int = 2) -> None:
        """Wait until the lease was read again from beginning to end."""
        wanted = self.looks + times
        while self.looks < wanted:
            assert self.look.wait(LONG_S)
            self.look.clear()


def test_a_reader_writes_last_outcomes_when_the_sessions_loop_has_ended(scene: Scene) -> None:
    session, books = scene.session(a_lease()), Books(a_lease())
    scene.brake.open.set()
    session.make_safe()
    session.close()
    wake = Event()
    reader = LeaseReader(cast("ManualStore", books), "l1", wake)
    session._tell = reader.tell
    books.demands = (a_demand("supply_on"),)
    reader.begin(session)
    reader.tell(a_demand("go_to"), DemandState.DONE, Answer("at rest"))
    books.looked_at()
    session.leave("ended by bob")
    reader.end(LONG_S)
    assert books.answers == {"go_to": DemandState.DONE, "supply_on": DemandState.STOPPED}


def test_a_reader_gives_no_demand_after_its_delivery_has_ended(scene: Scene) -> None:
    books, given = Books(a_lease()), []
    session = cast("Any", SimpleNamespace(expires=lambda lease: None, demand=given.append))
    reader = LeaseReader(cast("ManualStore", books), "l1", Event())
    reader.end_delivery()
    books.demands = (a_demand("supply_on"),)
    reader.begin(session)
    books.looked_at()
    reader.tell(a_demand("go_to"), DemandState.DONE, Answer())
    reader.end(LONG_S)
    assert (given, books.answers) == ([], {"go_to": DemandState.DONE})


class Lab:
    """A runner on a registered simulated bench whose supply falls silent, and the lease that it runs in a thread."""

    def __init__(self, driver: FailingDriver, books: Books) -> None:
        self.books, self.trail = books, []
        stores: Any = SimpleNamespace(manual=books, benches=books)
        trail: Any = SimpleNamespace(add=self.trail.append)
        self.runner = ManualRunner(stores, trail, driver, LiveBoard(cast("Any", None), "sim"))
        self.thread = Thread(target=self.runner.run, args=(books.lease,))

    def noted(self) -> dict[str, Any]:
        """The detail of `manual_ended` once the lease has ended."""
        self.thread.join(LONG_S)
        (entry,) = self.trail
        return entry.detail


def test_a_demand_that_comes_while_a_lost_lease_brakes_is_not_carried_out(tmp_path: Path) -> None:
    gates: list[Gate] = []

    def change(bench: Bench) -> None:
        inner = cast("Any", bench).inner
        inner.chamber.read = _silent
        gates.append(Gate(inner.turntable.make_safe))
        inner.turntable.make_safe = gates[0]

    lab = Lab(FailingDriver(tmp_path, change), Books(a_lease()))
    lab.thread.start()
    while not gates:
        lab.books.looked_at(1)
    assert gates[0].entered.wait(LONG_S)
    lab.books.demands = (a_demand("supply_on"), a_demand("rate"))
    lab.runner.wake()
    lab.books.looked_at(3)
    gates[0].open.set()
    assert lab.noted() == {"because": "Disconnected: no answer", "safe": True}
    state = DeviceRegister(tmp_path, "sim").read()
    assert state is not None
    assert state.unsafe == ()
    journal = (tmp_path / "bench-sim.journal").read_text()
    assert "supply.make_safe.done" in journal
    assert "switch_on" not in journal
    assert "command_rate" not in journal
    assert lab.books.stops == []


class Unsure(FailingDriver):
    """Its register has the unit as on when a lease has ended, whatever was done; a new link may help or not."""

    helps = True

    def device_state(self) -> DeviceState | None:
        return DeviceState(powered=True)

    def make_safe(self, by: str) -> Any:
        if not self.helps:
            raise BenchError("the supply does not answer")


@pytest.mark.parametrize(
    ("helps", "then"), [(True, "a new link has made it safe since"), (False, "the supply does not answer")]
)
def test_a_bench_that_does_not_read_as_safe_is_stopped_and_not_noted_as_safe(
    tmp_path: Path, helps: bool, then: str
) -> None:
    driver = Unsure(tmp_path)
    driver.helps = helps
    lab = Lab(driver, Books(replace(a_lease(), end_asked="bob")))
    lab.thread.start()
    assert lab.noted() == {"because": "ended by bob", "safe": False}
    assert lab.books.end_of == ("ended by bob", False)
    assert lab.books.stops == [f"could not be made safe: at the end of manual mode the unit is on; {then}"]
