"""A session of manual mode that is being left: no demand reaches a device while, or after, the bench is made safe.

The bench is a simulated one whose table takes as long to be made safe as the test wants, so every demand comes during
that. Waits have no share in what is found: each is for an event of the session's own thread.
"""

import asyncio
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import replace
from threading import Thread
from typing import cast

import pytest

from bench_service.bench.driven import ShuttingDown
from bench_service.jobs.manual.session import ManualSession
from bench_service.model.manual import DemandKind, DemandState
from bench_service.wall_clock import now, pause_async
from procedures.bench.errors import Disconnected, Stopped
from tests.kit.manual_scene import LONG_S, Gate, Scene, a_demand, a_lease, silent


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
    "a lost device": lambda session: setattr(session._bench.chamber or session._bench.supply, "read", silent),
    "its time": lambda session: session.expires(replace(session.lease, until=now())),
}
WORDS = {
    "a stop": "stopped by an operator",
    "a shutdown": "the service ended",
    "an end": "ended by bob",
    "a lost device": "no answer",
    "its time": "its time has ended",
}


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
