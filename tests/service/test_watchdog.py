"""Device links that fall silent: the job ends, the device is named, and the bench is not free before it is safe."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Generator
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Event, Thread
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from numpy.typing import NDArray

from bench_service import driving
from bench_service.bench import driven
from bench_service.bench.devices import DeviceState
from bench_service.bench.watchdog import TimeLimits, Watchdog
from bench_service.campaigns.stores import Stores
from bench_service.drivers.device_faults import FaultPlan
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.jobs import runner as runner_of_jobs
from bench_service.jobs.runner import JobRunner, StepOutcome
from bench_service.model.job import Failure, Job, JobState
from bench_service.persistence import open_stores
from bench_service.wall_clock import monotonic_s, pause
from procedures.bench import Bench, BenchNeeds
from procedures.bench.imu import Stream
from tests.kit.begun_job import prepared
from tests.kit.failing_driver import IMPATIENT, FailingDriver


async def never(*_: object) -> None:
    await asyncio.Event().wait()


def lost(*_: object) -> Awaitable[None]:
    """As a vendor's library that does not return: no cancel can land."""
    released.wait(30)
    return asyncio.sleep(0)


released = Event()


@pytest.fixture
def stores(sqlite_url: str, monkeypatch: pytest.MonkeyPatch) -> Generator[Stores]:
    monkeypatch.setattr(driven, "TIME_LIMITS", IMPATIENT)
    monkeypatch.setattr(driven, "UNWIND_S", 0.4)
    released.clear()
    made, database = open_stores(sqlite_url)
    yield made
    released.set()
    database.dispose()


def failed_first_station(stores: Stores, driver: FailingDriver) -> tuple[JobRunner, Job, str]:
    """The runner, the job, and why its first station failed; in time."""
    runner, job = prepared(stores, driver, lambda: True)
    begun = monotonic_s()
    outcome = runner.acquire(job.id, 0)
    assert monotonic_s() - begun < 20.0
    assert outcome.failure is not None
    assert outcome.failure.kind == "Disconnected", outcome.failure
    return runner, job, outcome.failure.message


def safe(driver: FailingDriver) -> bool:
    state = driver.device_state()
    assert state is not None
    return state.safe


def hang_move(how: Callable[..., Any]) -> Callable[[Bench], None]:
    def change(bench: Bench) -> None:
        bench.turntable._table.move_to = how

    return change


@pytest.mark.parametrize("how", [never, lost])
def test_a_table_that_does_not_answer_is_named_and_the_bench_made_safe(
    stores: Stores, tmp_path: Path, how: Callable[..., Any]
) -> None:
    driver = FailingDriver(tmp_path, hang_move(how))
    runner, job, why = failed_first_station(stores, driver)
    assert why.startswith("the turntable has not answered turntable.move_to for 0.4 s; the last answer was to supply.")
    assert not safe(driver)
    assert runner.make_safe(job.id).good
    assert safe(driver)
    assert stores.benches.bench_stop("sim") is None
    notes = str(stores.jobs.events(job.id))
    assert ("made safe over a new link" in notes) == (how is lost)
    second = SimulatedDriver("sim", register=DeviceRegister(tmp_path, "sim"))
    second.open("SIM-0001", 1, None, BenchNeeds(), "next").close()  # the link is free, though a thread hangs in it


def test_a_unit_that_stops_sending_is_named(stores: Stores, tmp_path: Path) -> None:
    async def two_blocks(blocks: AsyncIterator[NDArray[np.int32]]) -> AsyncIterator[NDArray[np.int32]]:
        yield await anext(blocks)
        await asyncio.Event().wait()

    def change(bench: Bench) -> None:
        unit = bench.imu._imu
        record = unit.record

        def cut(*given: Any) -> Stream:
            stream = record(*given)
            return replace(stream, blocks=two_blocks(stream.blocks))

        unit.record = cut

    driver = FailingDriver(tmp_path, change)
    runner, job, why = failed_first_station(stores, driver)
    assert "the imu has not answered imu.block" in why
    assert runner.make_safe(job.id).good
    assert safe(driver)


def test_a_bench_that_cannot_be_made_safe_is_not_free_until_a_person_releases_it(
    stores: Stores, tmp_path: Path
) -> None:
    def fall_silent(bench: Bench) -> None:
        hang_move(lost)(bench)
        driver.unreachable = True

    driver = FailingDriver(tmp_path, fall_silent)
    runner, job, _ = failed_first_station(stores, driver)
    outcome = runner.make_safe(job.id)
    assert outcome.failure is not None
    assert outcome.failure.kind == "NotSafe"
    assert "nothing answers on the table's line" in outcome.failure.message
    stop = stores.benches.bench_stop("sim")
    assert stop is not None
    assert stop.reason.startswith("could not be made safe: the turntable has not answered")
    runner.end_early(job.id, outcome)
    assert stores.jobs.get(job.id).state is JobState.FAILED
    assert stores.recordings.of_job(job.id) == ()


def test_a_cancel_during_a_hang_is_seen_at_once_and_still_ends_safe(stores: Stores, tmp_path: Path) -> None:
    driver = FailingDriver(tmp_path, hang_move(lost))
    runner, job = prepared(stores, driver, lambda: True)

    def change(bench: Bench) -> None:
        hang_move(lost)(bench)
        stores.jobs.request_cancel(job.id, job.created_at)

    driver.change = change
    assert runner.acquire(job.id, 0).cancelled
    assert runner.make_safe(job.id).good
    assert safe(driver)


def test_a_fault_for_an_exercise_goes_the_same_way(stores: Stores, tmp_path: Path) -> None:
    plan = FaultPlan.parse('{"rules": [{"verb": "turntable.move_to", "kind": "disconnect", "probability": 1}]}')
    driver = FailingDriver(tmp_path, faults=plan)
    runner, job, why = failed_first_station(stores, driver)
    assert why == "turntable.move_to: the link is lost, an injected fault"
    assert runner.make_safe(job.id).good
    assert safe(driver)


class Clock:
    """A clock that the test turns."""

    def __init__(self) -> None:
        self.s = 0.0

    def now_s(self) -> float:
        return self.s

    async def sleep(self, seconds: float) -> None: ...


def test_what_counts_as_silence() -> None:
    clock, limits = Clock(), TimeLimits(5.0, 2.0, 120.0, 5.0)
    real, simulated = Watchdog(clock, False, limits), Watchdog(clock, True, limits)
    for dog in (real, simulated):
        assert dog.silence(100.0, 100.0) is None  # nothing is asked of anybody
        dog.begin("turntable.move_to", {})
        assert dog.silence(4.9, 10.0) is None
    assert simulated.silence(0.0, 10.0) is None
    assert simulated.silence(5.1, 10.0) == (
        "the turntable has not answered turntable.move_to for 5 s; the last answer was to none so far"
    )
    clock.s += 1e-3
    assert simulated.silence(100.0, 100.0) is None  # its clock went on: it lives
    assert real.silence(100.0, 100.0) is None  # a long move
    assert real.silence(0.2, 0.4) is None
    for _ in range(20):
        real.silence(1e6, 0.4)  # a suspended process looks late: the time it was away does not count
    assert real.silence(0.0, 0.4) is None
    assert "turntable.move_to for 120 s" in str(real.silence(20.0, 20.0))
    real.end("turntable.move_to", None)
    assert real.silence(1e3, 1e3) is None
    real.begin("imu.stream", {})
    assert real.silence(1e3, 1e3) is None  # nobody has asked for a block yet
    real.asked("imu")
    assert real.silence(0.0, 1.0) is None
    assert "the imu has not answered imu.block for 2 s; the last answer was to turntable.move_to" in str(
        real.silence(2.1, 10.0)
    )
    real.heard("imu")
    real.begin("operator.set_by_hand", {})
    assert real.silence(1e5, 1e5) is None  # a person takes the time that it takes


class Unsure(FailingDriver):
    """Its register has the unit as on at the job's end, whatever was done."""

    ended = False

    def device_state(self) -> Any:
        state = super().device_state()
        return DeviceState(powered=True) if self.ended and state is not None and not state.linked else state

    def make_safe(self, by: str) -> Any:
        self.ended = False
        return super().make_safe(by)


def test_a_job_whose_devices_do_not_read_as_safe_at_its_end_stops_the_bench(stores: Stores, tmp_path: Path) -> None:
    driver = Unsure(tmp_path)
    runner, job = prepared(stores, driver, lambda: True)
    assert runner.acquire(job.id, 0).good
    driver.ended = True
    outcome = runner.make_safe(job.id)
    why = "was not safe at the end of the job: the unit is on; it was made safe afterwards, over a new link"
    assert outcome.failure == Failure("NotSafe", f"the bench {why}")
    stop = stores.benches.bench_stop("sim")
    assert stop is not None
    assert stop.reason == why


def test_a_stop_tries_again_at_devices_that_an_attempt_has_given_up(
    stores: Stores, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A command that drives a bench has no supervisor: nobody else tries before a person releases the bench."""
    monkeypatch.setattr(runner_of_jobs, "AGAIN_S", 0.05)
    driver = FailingDriver(tmp_path)
    runner, job = prepared(stores, driver, lambda: True)

    def fall_silent(bench: Bench) -> None:
        hang_move(lost)(bench)
        driver.unreachable = True

    driver.change = fall_silent
    assert runner.acquire(job.id, 0).failure is not None
    runner.stop_now()
    assert runner.make_safe(job.id).failure is not None
    watch: Any = SimpleNamespace(supervisor=lambda: None, silent_supervisor=lambda: None)
    stop_again = partial(driving._stop_now, runner, MagicMock(), watch)
    stop_again()
    assert not safe(driver)
    driver.unreachable = False
    watch.supervisor = lambda: "a supervisor, which does it"
    pause(0.06)
    stop_again()
    assert not safe(driver)
    watch.supervisor = lambda: None
    stop_again()
    assert safe(driver)


def test_the_jobs_own_thread_does_not_meet_the_stops_link(stores: Stores, tmp_path: Path) -> None:
    """While the stop's thread gives a lost link back, the devices are not yet free: the job's thread waits for it."""
    driver = FailingDriver(tmp_path, hang_move(lost))
    runner, job = prepared(stores, driver, lambda: True)
    assert runner.acquire(job.id, 0).failure is not None
    session, closing, go_on = runner._session, Event(), Event()
    assert session is not None
    close = session.close

    def slow() -> None:
        closing.set()
        assert go_on.wait(10)
        close()

    session.close = slow
    stopping, ending = Thread(target=runner.stop_now), Thread(target=lambda: ends.append(runner.make_safe(job.id)))
    ends: list[StepOutcome] = []
    stopping.start()
    assert closing.wait(10)
    ending.start()
    ending.join(0.2)
    go_on.set()
    for thread in (stopping, ending):
        thread.join(10)
    assert ends == [StepOutcome()]
    assert safe(driver)
    assert stores.benches.bench_stop("sim") is None
