"""A stop at any moment of a job's work: once it has returned, the work gives no further demand to a device."""

import asyncio
import sys
from collections.abc import Callable, Generator
from concurrent.futures import Future
from contextlib import suppress
from threading import Event, Thread

import pytest

from bench_service.bench import driven
from bench_service.bench.driven import UNWIND_S, DrivenBench
from bench_service.wall_clock import monotonic_s
from procedures.bench.errors import Disconnected, Stopped
from simulators.world import WorldConfig, build
from tests.kit.busy_machine import BUSY_S

ROUNDS = 200
"""Stops; without the lock that begins and stops share, one in thirty found work that began after it."""


class Worker(DrivenBench):
    """Looks at the table again and again, as a procedure does, and counts its looks."""

    def __init__(self, stop_stands: Callable[[], bool] = lambda: False) -> None:
        super().__init__("a job", build(WorldConfig()), lambda: False, stop_stands)
        self.looks = 0

    def work(self) -> None:
        with suppress(Stopped):
            while True:
                self._run(self._look())

    async def _look(self) -> None:
        self.looks += 1
        await self._bench.turntable.read()
        self.looks += 1


@pytest.fixture
def hasty() -> Generator[None]:
    """Threads hand over as often as they can."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.usefixtures("hasty")
def test_no_work_begins_after_a_stop() -> None:
    late = 0
    for _ in range(ROUNDS):
        worker = Worker()
        job = Thread(target=worker.work)
        job.start()
        while not worker.looks:
            pass
        worker.stop()
        looks = worker.looks
        worker.make_safe()
        job.join(10)
        assert not job.is_alive()
        late += worker.looks != looks
        worker.close()
    assert late == 0


def test_a_stop_that_comes_after_the_session_has_ended_has_nothing_to_leave() -> None:
    worker = Worker()
    job = Thread(target=worker.work)
    job.start()
    while (under_way := worker._under_way) is None:
        pass
    worker.stop()
    job.join(10)
    worker.make_safe()
    worker.close()
    worker._under_way = under_way  # as a stop reads it that comes while the session ends
    worker.stop()


class Careless(Worker):
    """Its procedure fails while it is left."""

    async def _leave(self) -> None:
        raise ValueError("cannot divide")


def test_a_defect_in_a_procedures_ending_does_not_keep_the_devices_from_being_safe(
    caplog: pytest.LogCaptureFixture,
) -> None:
    worker = Careless()
    worker.make_safe()
    worker.close()
    assert "a job: its procedure's step could not be left in order" in caplog.text
    assert "cannot divide" in caplog.text


def test_no_work_begins_while_a_stop_stands_on_the_channel_though_nobody_has_told_the_session() -> None:
    """A stop may come while the devices are still being opened: there is no session yet that could be told."""
    standing: list[bool] = []
    worker = Worker(lambda: bool(standing))
    worker._run(worker._look())
    standing.append(True)
    looks = worker.looks
    with pytest.raises(Stopped):
        worker._run(worker._look())
    assert worker.looks == looks
    worker.make_safe()
    worker.close()


class Slow(Worker):
    """Its table takes longer to brake than work takes to unwind."""

    async def _leave(self) -> None:
        await asyncio.sleep(1.5 * UNWIND_S)


def test_a_stop_while_the_jobs_own_thread_makes_safe_is_not_taken_for_a_lost_driver() -> None:
    worker = Slow()
    worker._run(worker._look())
    job = Thread(target=worker.make_safe)
    job.start()
    while not worker._unwinding:
        pass
    worker._under_way = Future()  # as a stop reads it that comes while the job's step ends
    worker.stop()
    job.join(10)
    assert worker._lost is None
    worker.close()


def test_a_session_that_ended_before_it_was_safe_does_not_say_that_it_is() -> None:
    worker = Worker()
    worker.close()
    with pytest.raises(Disconnected, match="ended before its devices were safe"):
        worker.make_safe()


class Hanging(Worker):
    """Its procedure does not come to the end of its own ending, and takes no cancel."""

    async def _leave(self) -> None:
        while True:
            with suppress(asyncio.CancelledError):
                await asyncio.sleep(60.0)
            if self._closed:
                return


def test_a_procedure_that_does_not_end_keeps_no_device_from_being_safe(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a supervisor, as under `bench run`, nothing else would have ended it."""
    monkeypatch.setattr(driven, "LEAVE_S", 0.2)
    worker = Hanging()
    begun_s = monotonic_s()
    worker.make_safe()
    assert monotonic_s() - begun_s < BUSY_S
    assert worker._is_safe
    assert "a job: its procedure's step could not be left within 0.2 s" in caplog.text
    worker.close()


def test_a_stop_while_real_devices_brake_in_tasks_of_their_own_is_not_taken_for_a_lost_driver(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(driven, "UNWIND_S", 0.2)
    worker = Worker()
    table, braking = worker._bench.turntable, Event()

    async def brake() -> None:
        braking.set()
        await asyncio.sleep(0.6)

    monkeypatch.setattr(table, "make_safe", brake)
    worker._bench.safe_s = {"turntable": 10.0}
    job = Thread(target=worker.make_safe)
    job.start()
    assert braking.wait(10)
    worker._under_way = Future()
    worker.stop()
    job.join(10)
    assert (worker._lost, worker._is_safe) == (None, True)
    worker.close()
