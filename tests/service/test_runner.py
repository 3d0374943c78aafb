"""Steps of a job that end badly: the lease is lost, the bench cannot be made safe, the engine does not start."""

from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from threading import Barrier, Event
from typing import Any

import pytest

from bench_service.bench.driven import ShuttingDown
from bench_service.campaigns.stores import Stores
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.jobs.dispatcher import Dispatcher, Unfinished
from bench_service.jobs.queue import QueueEntry
from bench_service.jobs.runner import JobRunner, StepOutcome
from bench_service.jobs.worker import Worker
from bench_service.model.errors import NotReady
from bench_service.model.job import Failure, JobState
from bench_service.persistence import open_stores
from bench_service.service import BenchService
from bench_service.wall_clock import new_id, now, pause
from procedures.bench import Bench, BenchNeeds
from procedures.bench.errors import DeviceFault
from tests.kit.begun_job import IdleDispatcher, IdleEngine, planner_of, prepared, safety_of


class SureLease:
    """A lease that is never lost."""

    def held(self) -> bool:
        return True

    def regain(self) -> bool:
        return True

    def release(self) -> None: ...


class JammedDriver(SimulatedDriver):
    """A bench whose table does not obey the last demand."""

    def open(
        self,
        unit: str,
        seed: int | None,
        checkpoint: dict[str, Any] | None,
        needs: BenchNeeds,
        job: str | None = None,
    ) -> Bench:
        bench = super().open(unit, seed, checkpoint, needs, job)

        async def refuse() -> None:
            raise DeviceFault("the table's brake does not close")

        bench.turntable.make_safe = refuse  # type: ignore[method-assign]
        return bench


@pytest.fixture
def stores(sqlite_url: str) -> Generator[Stores]:
    made, database = open_stores(sqlite_url)
    yield made
    database.dispose()


def test_without_the_lease_no_station_is_begun(stores: Stores) -> None:
    runner, job = prepared(stores, SimulatedDriver("sim"), lambda: False)
    outcome = runner.acquire(job.id, 0)
    assert outcome.failure is not None
    assert (outcome.failure.kind, outcome.failure.station) == ("LeaseLost", 0)
    assert runner.running_job() is None
    again = runner.end_early(job.id, outcome)  # whoever has the lease goes on with it
    assert (again.state, again.attempt, again.retries_left) == (JobState.QUEUED, 2, 0)
    assert again.not_before is not None
    assert stores.jobs.events(job.id)[-1].data["again_because"]["kind"] == "LeaseLost"
    assert stores.recordings.of_job(job.id) == ()


def test_a_bench_that_cannot_be_made_safe_fails_the_job_and_keeps_its_recording(stores: Stores) -> None:
    runner, job = prepared(stores, JammedDriver("sim"), lambda: True)
    assert runner.acquire(job.id, 0).good
    outcome = runner.make_safe(job.id)
    assert outcome.failure is not None
    assert outcome.failure.kind == "NotSafe"
    assert "brake does not close" in outcome.failure.message
    runner.end_early(job.id, outcome)
    ended = stores.jobs.get(job.id)
    assert ended.failure is not None
    assert (ended.state, ended.failure.kind) == (JobState.FAILED, "NotSafe")
    assert len(stores.recordings.of_job(job.id)) == 1
    assert any("brake" in str(event.data) for event in stores.jobs.events(job.id) if event.kind == "note")


def test_a_bench_is_made_safe_after_a_restart_in_which_nothing_was_driven(stores: Stores) -> None:
    runner, job = prepared(stores, JammedDriver("sim"), lambda: True)
    outcome = runner.make_safe(job.id)
    assert outcome.failure is not None
    assert outcome.failure.kind == "NotSafe"  # it was asked, and said no


def test_an_engine_that_does_not_start_is_told_to_whoever_needs_it(stores: Stores) -> None:
    driver = SimulatedDriver("sim")
    planner = planner_of(stores, driver)

    def fail(_: JobRunner) -> IdleEngine:
        raise OSError("no books")

    worker = Worker(JobRunner(stores, planner, driver, "test", lambda: True), fail, lambda *_: IdleDispatcher())
    service = BenchService(stores, driver, planner, worker, "test", safety_of(stores, driver))
    service.register()
    service.begin()
    with pytest.raises(NotReady, match="did not start: OSError: no books"):
        service.ready()
    service.stop()


def test_a_job_that_was_queued_again_while_the_dispatcher_looked_stays_queued(stores: Stores) -> None:
    """A recovered workflow does so in its own thread: the job first goes back into the queue, then it is done."""
    runner, job = prepared(stores, SimulatedDriver("sim"), lambda: True)
    asked = Event()

    class EndingEngine(IdleEngine):
        def unfinished(self, job: QueueEntry) -> Unfinished:
            if not asked.is_set():
                why = Failure("Disconnected", "a test")
                stores.queue.requeue(job.id, now(), now() + timedelta(minutes=4), why, spend=False)
            asked.set()
            return Unfinished(gone=Failure("EngineGaveUp", "the job engine ended this job as SUCCESS"))

    dispatcher = Dispatcher("sim", stores, runner, EndingEngine(), SureLease(), 0.05)
    dispatcher.begin()
    assert asked.wait(20)
    pause(0.5)
    dispatcher.shut_down()
    assert stores.jobs.get(job.id).state is JobState.QUEUED


def test_an_attempt_whose_end_was_noted_already_ends_nothing_more(stores: Stores) -> None:
    """The answer to its last note was lost with the database: the workflow says it again."""
    runner, job = prepared(stores, SimulatedDriver("sim"), lambda: True)
    why = Failure("Disconnected", "a test")
    stores.queue.requeue(job.id, now(), None, why, spend=False)
    events = len(stores.jobs.events(job.id))
    again = StepOutcome(Failure("Disconnected", "a test"))
    assert runner.end_early(job.id, again).state is JobState.QUEUED
    assert runner.conclude(job.id).good
    assert runner.acquire(job.id, 0).cancelled
    assert len(stores.jobs.events(job.id)) == events
    assert stores.results.list(job_id=job.id).items == ()


def test_a_procedure_that_this_version_lacks_leaves_the_bench_to_the_next_job(stores: Stores, tmp_path: Path) -> None:
    driver = SimulatedDriver("sim", register=DeviceRegister(tmp_path, "sim"))
    runner, job = prepared(stores, driver, lambda: True)
    runner.end_early(job.id, StepOutcome(cancelled=True))
    stranger = replace(job, id=new_id(), procedure="of_a_newer_service")
    for each in (stranger, replace(job, id=new_id())):
        stores.jobs.add(replace(each, state=JobState.QUEUED))
        entry = stores.queue.look("sim", now()).next()
        assert entry is not None
        assert runner.claim(entry) is not None
        outcome = runner.acquire(each.id, 0)
        assert outcome.good is (each is not stranger), outcome
        assert runner.make_safe(each.id).good
        runner.end_early(each.id, StepOutcome(cancelled=True) if outcome.good else outcome)
    failure = stores.jobs.get(stranger.id).failure
    assert failure is not None
    assert (failure.kind, "of_a_newer_service" in failure.message) == ("NotFound", True)


def test_a_service_that_is_asked_to_end_while_a_bench_is_opened_records_nothing(stores: Stores) -> None:
    asked: list[JobRunner] = []

    class SlowDriver(SimulatedDriver):
        def open(
            self,
            unit: str,
            seed: int | None,
            checkpoint: dict[str, Any] | None,
            needs: BenchNeeds,
            job: str | None = None,
        ) -> Bench:
            asked[0].shut_down()
            return super().open(unit, seed, checkpoint, needs, job)

    runner, job = prepared(stores, SlowDriver("sim"), lambda: True)
    asked.append(runner)
    with pytest.raises(ShuttingDown):
        runner.acquire(job.id, 0)
    assert stores.recordings.of_job(job.id) == ()
    assert runner.make_safe(job.id).good


def test_stops_of_several_people_at_once_do_not_wait_for_each_other(stores: Stores) -> None:
    """Each of them waits until the procedure has left its step: never for another one that waits too."""
    runner, job = prepared(stores, SimulatedDriver("sim", real_time_factor=1.0), lambda: True)
    with ThreadPoolExecutor(9) as pool:
        recording = pool.submit(runner.acquire, job.id, 0)
        while runner._session is None or runner._session._under_way is None:
            pause(0.005)
        pause(0.1)
        session, together = runner._session, Barrier(8)

        def stop() -> None:
            together.wait()
            session.stop()

        for stopping in [pool.submit(stop) for _ in range(8)]:
            stopping.result(20)
        assert recording.result(20).cancelled
    assert session._lost is None, "the driver came back at once"
    assert runner.make_safe(job.id).good
    session._thread.join(5)
    assert not session._thread.is_alive()
