"""Gauges of jobs by state count each job once, in the state that it is in."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

from bench_service.api.metrics import Snapshot
from bench_service.campaigns.stores import Stores
from bench_service.jobs.events.hub import EventHub
from bench_service.model.job import Failure, Job, JobState
from bench_service.service import BenchService
from bench_service.telemetry.tallies import Tallies
from bench_service.wall_clock import now
from procedures.core.limits import Verdict


def test_a_job_that_failed_and_was_resumed_is_one_job(stores: Stores, new_job: Callable[..., Job]) -> None:
    tallies = Tallies(stores.tallies)
    snapshot = Snapshot(cast(BenchService, SimpleNamespace(stores=stores)), tallies, cast(EventHub, None))

    def states() -> dict[str, float]:
        tallies.update()
        family = next(iter(snapshot.collect()))
        assert family.name == "bench_jobs"
        return {sample.labels["state"]: sample.value for sample in family.samples if sample.value}

    job, cancelled = stores.jobs.add(new_job()), stores.jobs.add(new_job())

    def moved(to: JobState, **more: Any) -> None:
        stores.jobs.transition(job.id, to, at=now(), **more)

    stores.jobs.transition(cancelled.id, JobState.CANCELLED, at=now())
    moved(JobState.RUNNING)
    moved(JobState.FAILED, failure=Failure("StorageFull", "the disk is full"))
    assert states() == {"failed": 1, "cancelled": 1}
    stores.jobs.resume(job.id, now())
    assert states() == {"queued": 1, "cancelled": 1}
    moved(JobState.RUNNING)
    moved(JobState.SUCCEEDED, verdict=Verdict.PASS)
    assert states() == {"succeeded": 1, "cancelled": 1}


def test_stations_of_a_resumed_job_are_counted_once(stores: Stores, new_job: Callable[..., Job]) -> None:
    tallies = Tallies(stores.tallies)
    other = stores.jobs.add(new_job())
    stores.jobs.transition(other.id, JobState.RUNNING, at=now())
    stores.jobs.station_done(other.id, 0, now(), {})
    stores.jobs.transition(other.id, JobState.CANCELLED, at=now())
    job = stores.jobs.add(new_job())

    def stations() -> tuple[int, int]:
        """Stations by this process, and by one that starts now."""
        anew = Tallies(stores.tallies)
        for each in (tallies, anew):
            each.update()
        return tallies.stations, anew.stations

    def moved(to: JobState, **more: Any) -> None:
        stores.jobs.transition(job.id, to, at=now(), **more)

    def station(index: int) -> None:
        stores.jobs.station_done(job.id, index, now(), {})

    moved(JobState.RUNNING)
    station(0)
    station(1)
    assert stations() == (3, 3)
    moved(JobState.FAILED, failure=Failure("StorageFull", "the disk is full"))
    assert stations() == (3, 3)
    stores.jobs.resume(job.id, now())
    assert stations() == (3, 3)
    moved(JobState.RUNNING)
    station(2)
    assert stations() == (4, 4)
    moved(JobState.FAILED, failure=Failure("StorageFull", "the disk is full"))
    assert stations() == (4, 4)
    stores.jobs.resume(job.id, now())
    moved(JobState.RUNNING)
    moved(JobState.SUCCEEDED, verdict=Verdict.PASS)
    assert stations() == (4, 4)
