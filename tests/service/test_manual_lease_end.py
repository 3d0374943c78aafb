"""Reader and runner of a lease of manual mode at its end: last demands, their outcomes, whether the bench is safe."""

from dataclasses import replace
from pathlib import Path
from threading import Event, Thread
from types import SimpleNamespace
from typing import Any, cast

import pytest

from bench_service.bench.devices import DeviceState
from bench_service.bench.live.values import LiveBoard
from bench_service.drivers.device_register import DeviceRegister
from bench_service.jobs.manual.reader import LeaseReader
from bench_service.jobs.manual.runner import ManualRunner
from bench_service.jobs.manual.store import LeaseNews, ManualStore
from bench_service.model.manual import Answer, DemandState, ManualDemand, ManualLease
from procedures.bench import Bench
from procedures.bench.errors import BenchError
from tests.kit.failing_driver import FailingDriver
from tests.kit.manual_scene import LONG_S, Gate, Scene, a_demand, a_lease, silent


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


def test_a_reader_writes_last_outcomes_when_the_sessions_loop_has_ended() -> None:
    scene = Scene()
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


def test_a_reader_gives_no_demand_after_its_delivery_has_ended() -> None:
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
        inner.chamber.read = silent
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
        return DeviceState()


@pytest.mark.parametrize(
    ("helps", "then"),
    [
        (True, "it was made safe afterwards, over a new link"),
        (False, "it could not be made safe: the supply does not answer"),
    ],
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
    assert lab.books.stops == [f"was not safe at the end of manual mode: the unit is on; {then}"]
