"""Jobs: what is stored comes back, only legal changes happen, and every change leaves an event."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import timedelta, timezone
from itertools import product
from threading import Barrier

import pytest

from bench_service.campaigns.stores import Stores
from bench_service.model.errors import IdempotencyConflict, IllegalTransition, NotFound, StorageFailure
from bench_service.model.job import FINAL, LEGAL, Failure, Job, JobState
from bench_service.model.records import BenchStop, Idempotency
from bench_service.persistence import Database
from bench_service.persistence.stores import stores_of
from bench_service.wall_clock import new_id, now
from procedures.core.limits import Verdict
from tests.stops import release_all
from tests.storage.conftest import NOW

NewJob = Callable[..., Job]
LATER = timedelta(seconds=5)


def test_a_job_comes_back_as_it_was(stores: Stores, new_job: NewJob) -> None:
    job = new_job()
    numbered = replace(job, number=1)
    assert stores.jobs.add(job) == numbered
    back = stores.jobs.get(job.id)
    assert back == numbered
    assert back.created_at.utcoffset() == timedelta(0)
    assert list(back.parameters) == ["zeta", "alpha"], "documents keep the order of their keys"
    assert repr(back.parameters) == repr(job.parameters), "and the spelling of their numbers"


def test_a_moment_of_another_zone_is_kept_and_one_without_is_refused(stores: Stores, new_job: NewJob) -> None:
    there = now().astimezone(timezone(timedelta(hours=5, minutes=30)))
    job = stores.jobs.add(new_job(created_at=there))
    assert stores.jobs.get(job.id).created_at == there
    with pytest.raises(StorageFailure, match="time zone"):
        stores.jobs.add(new_job(created_at=there.replace(tzinfo=None)))


def test_numbers_that_are_not_numbers_are_refused(stores: Stores, new_job: NewJob) -> None:
    with pytest.raises(StorageFailure):
        stores.jobs.add(new_job(parameters={"x": float("nan")}))
    assert stores.jobs.list().items == ()


def test_every_change_of_state_is_legal_or_refused(stores: Stores, new_job: NewJob) -> None:
    for before, after in product(JobState, JobState):
        job = stores.jobs.add(new_job(state=before))
        if after is before:
            assert stores.jobs.transition(job.id, after, at=now()) == job
            assert len(stores.jobs.events(job.id)) == 1
        elif after in LEGAL[before]:
            assert stores.jobs.transition(job.id, after, at=now()).state is after
            assert stores.jobs.events(job.id)[-1].data["state"] == after.value
        else:
            with pytest.raises(IllegalTransition, match=f"is {before.value}; it cannot become {after.value}"):
                stores.jobs.transition(job.id, after, at=now())
            assert stores.jobs.get(job.id) == job
            assert len(stores.jobs.events(job.id)) == 1


def test_a_job_through_its_life(stores: Stores, new_job: NewJob) -> None:
    job = stores.jobs.add(new_job())
    start = job.created_at
    stores.jobs.transition(job.id, JobState.RUNNING, at=start + LATER)
    stores.jobs.station_done(job.id, 0, start + 2 * LATER, {"recording": "r0"})
    stores.jobs.station_done(job.id, 0, start + 2 * LATER, {"recording": "r0"})
    stores.jobs.station_done(job.id, 2, start + 3 * LATER, {})
    stores.jobs.note(job.id, "note", start + 4 * LATER, {"said": "hello"})
    failure = Failure("NotSettled", "the table did not come to rest", 2)
    stores.jobs.transition(job.id, JobState.INTERRUPTED, at=start + 5 * LATER, failure=failure)
    stopped = stores.jobs.get(job.id)
    assert (stopped.failure, stopped.stations_done, stopped.finished_at) == (failure, 3, start + 5 * LATER)
    queued = stores.jobs.transition(job.id, JobState.QUEUED, at=start + 6 * LATER)
    assert (queued.failure, queued.finished_at, queued.stations_done) == (None, None, 3)
    stores.jobs.transition(job.id, JobState.RUNNING, at=start + 7 * LATER)
    done = stores.jobs.transition(
        job.id, JobState.SUCCEEDED, at=start + 8 * LATER, verdict=Verdict.PASS, result_id="r-1"
    )
    assert done == replace(
        job,
        state=JobState.SUCCEEDED,
        verdict=Verdict.PASS,
        result_id="r-1",
        stations_done=3,
        attempt=2,
        queued_at=start + 6 * LATER,
        started_at=start + LATER,
        finished_at=start + 8 * LATER,
    )
    events = stores.jobs.events(job.id)
    assert [e.sequence for e in events] == list(range(1, 10))
    kinds = ["state", "state", "station", "station", "note", "state", "state", "state", "state"]
    assert [e.kind for e in events] == kinds
    assert events[2].data == {"station": 0, "recording": "r0"}
    assert events[2].at == start + 2 * LATER
    assert stores.jobs.events(job.id, after=7) == events[7:]
    assert stores.jobs.events(job.id, after=2, limit=3) == events[2:5]


@pytest.mark.parametrize("state", [JobState.QUEUED, JobState.PAUSED, JobState.INTERRUPTED])
def test_a_job_that_does_not_run_is_cancelled_at_once(stores: Stores, new_job: NewJob, state: JobState) -> None:
    job = stores.jobs.add(new_job(state=state))
    cancelled = stores.jobs.request_cancel(job.id, now())
    assert (cancelled.state, cancelled.verdict) == (JobState.CANCELLED, None)
    with pytest.raises(IllegalTransition, match="has ended"):
        stores.jobs.request_cancel(job.id, now())


def test_a_job_that_runs_is_asked_to_end(stores: Stores, new_job: NewJob) -> None:
    job = stores.jobs.add(new_job(state=JobState.RUNNING))
    assert not stores.jobs.cancel_requested(job.id)
    for _ in range(2):
        assert stores.jobs.request_cancel(job.id, now()).state is JobState.RUNNING
    assert stores.jobs.cancel_requested(job.id)
    assert [e.kind for e in stores.jobs.events(job.id)] == ["state", "note"]


def test_an_event_from_before_the_one_before_says_how_far_the_clock_was_set_back(
    stores: Stores, new_job: NewJob
) -> None:
    job = stores.jobs.add(new_job())
    begun = job.created_at + 100 * LATER
    stores.jobs.transition(job.id, JobState.RUNNING, at=begun)
    for seconds in (-4.0, -7200.0, -7200.0 - 6.0, 0.0):  # clocks of two hosts may differ by a few seconds
        stores.jobs.note(job.id, "note", begun + timedelta(seconds=seconds), {"at": seconds})
    events = stores.jobs.events(job.id, after=2)
    assert [e.data["at"] for e in events] == [-4.0, -7200.0, -7206.0, 0.0]
    assert [e.data.get("clock_set_back_s") for e in events] == [None, 7196.0, 6.0, None]
    assert events[1].at == begun - timedelta(hours=2), "what the clock said"


def test_a_job_is_put_aside_and_taken_up_again_as_its_next_attempt(stores: Stores, new_job: NewJob) -> None:
    job = stores.jobs.add(new_job(state=JobState.RUNNING, created_at=now()))
    for _ in range(2):
        assert stores.jobs.request_pause(job.id, now()).pause_requested
    assert stores.jobs.resume(job.id, now()).pause_requested is False  # the wish was taken back
    assert [e.data for e in stores.jobs.events(job.id, after=1)] == [{"pause_requested": w} for w in (True, False)]
    stores.jobs.request_pause(job.id, now())
    assert stores.jobs.put_aside(job.id, now()).state is JobState.PAUSED
    assert stores.jobs.put_aside(job.id, now()).state is JobState.PAUSED
    assert stores.jobs.request_pause(job.id, now()).state is JobState.PAUSED
    again = stores.jobs.resume(job.id, now())
    assert (again.state, again.attempt, again.pause_requested) == (JobState.QUEUED, 2, False)
    with pytest.raises(IllegalTransition, match="is queued; it cannot become queued"):
        stores.jobs.resume(job.id, now())
    assert stores.jobs.request_pause(job.id, now()).state is JobState.PAUSED  # one that waits, at once
    late = stores.jobs.add(new_job(state=JobState.RUNNING))
    stores.jobs.request_pause(late.id, now())
    stores.jobs.resume(late.id, now())  # while its bench is made safe
    back = stores.jobs.put_aside(late.id, now())
    assert (back.state, back.attempt) == (JobState.QUEUED, 2)
    with pytest.raises(IllegalTransition, match="is running and no pause was requested"):
        stores.jobs.resume(stores.jobs.add(new_job(state=JobState.RUNNING)).id, now())
    for state in FINAL:
        ended = stores.jobs.add(new_job(state=state))
        for verb in (stores.jobs.request_pause, stores.jobs.resume):
            with pytest.raises(IllegalTransition, match=f"is {state.value}"):
                verb(ended.id, now())


@pytest.mark.parametrize("taken_back", [False, True])
def test_a_cancel_while_a_job_is_put_aside_goes_first(stores: Stores, new_job: NewJob, taken_back: bool) -> None:
    job = stores.jobs.add(new_job(state=JobState.RUNNING, created_at=now()))
    stores.jobs.request_pause(job.id, now())
    if taken_back:
        stores.jobs.resume(job.id, now())
    stores.jobs.request_cancel(job.id, now())  # while its bench is made safe
    ended = stores.jobs.put_aside(job.id, now())
    assert (ended.state, ended.attempt, ended.cancel_requested) == (JobState.CANCELLED, 1, True)


def test_a_cancel_before_a_crash_is_settled_goes_first(stores: Stores, new_job: NewJob) -> None:
    for wished, state in ((True, JobState.CANCELLED), (False, JobState.INTERRUPTED)):
        job = stores.jobs.add(new_job(state=JobState.RUNNING, created_at=now(), cancel_requested=wished))
        stores.jobs.interrupt(job.id, now(), Failure("EngineGaveUp", "a test"))
        assert stores.jobs.get(job.id).state is state


def test_people_who_stop_a_bench_at_once_all_stop_it(stores: Stores, new_job: NewJob) -> None:
    with ThreadPoolExecutor(8) as people:
        for _ in range(12):
            at_once = Barrier(8)

            def press(who: int, together: Barrier = at_once) -> None:
                together.wait(20)
                stores.benches.stop_bench(BenchStop("sim", now(), f"person {who}"))

            list(people.map(press, range(8)))
            stop = stores.benches.bench_stop("sim")
            assert stop is not None
            assert stop.reason.startswith("person")
            release_all(stores.benches, "sim")


def test_a_bench_stays_stopped_until_it_is_released(stores: Stores) -> None:
    stop = BenchStop("b-1", NOW, "smoke")
    stores.benches.stop_bench(stop)
    stores.benches.stop_bench(BenchStop("b-1", NOW + LATER, "more smoke"))
    assert stores.benches.bench_stop("b-1") == stop
    assert stores.benches.bench_stop("b-2") is None
    for _ in range(2):
        release_all(stores.benches, "b-1")
    assert stores.benches.bench_stop("b-1") is None


def test_what_does_not_exist_is_not_found(stores: Stores) -> None:
    moment = now()
    asks: tuple[Callable[[], object], ...] = (
        lambda: stores.jobs.get("x"),
        lambda: stores.jobs.events("x"),
        lambda: stores.jobs.cancel_requested("x"),
        lambda: stores.jobs.request_cancel("x", moment),
        lambda: stores.jobs.request_pause("x", moment),
        lambda: stores.jobs.resume("x", moment),
        lambda: stores.jobs.transition("x", JobState.RUNNING, at=moment),
        lambda: stores.jobs.station_done("x", 0, moment, {}),
        lambda: stores.jobs.note("x", "note", moment, {}),
    )
    for ask in asks:
        with pytest.raises(NotFound, match="job 'x'"):
            ask()


def test_of_two_ends_one_wins(database: Database, stores: Stores, new_job: NewJob) -> None:
    """Eight askers, each with stores of its own, want different ends for each of five jobs."""
    ends = [JobState.SUCCEEDED, JobState.FAILED, JobState.CANCELLED, JobState.INTERRUPTED] * 2

    def ask(job_id: str, end: JobState) -> JobState | None:
        try:
            return stores_of(database).jobs.transition(job_id, end, at=now()).state
        except IllegalTransition:
            return None

    with ThreadPoolExecutor(8) as askers:
        for _ in range(5):
            job = stores.jobs.add(new_job(state=JobState.RUNNING))
            won = {w for w in askers.map(lambda end, job=job: ask(job.id, end), ends) if w}
            final = stores.jobs.get(job.id).state
            events = stores.jobs.events(job.id)
            assert [e.sequence for e in events] == list(range(1, len(events) + 1))
            # An interrupted job may still be cancelled, and no other second change is legal.
            assert won - {final} <= {JobState.INTERRUPTED}
            assert len(events) - 1 == len(won)


def test_events_of_many_writers_are_numbered_without_gaps(stores: Stores, new_job: NewJob) -> None:
    job = stores.jobs.add(new_job())
    with ThreadPoolExecutor(6) as writers:
        list(writers.map(lambda i: stores.jobs.note(job.id, "note", now(), {"i": i}), range(30)))
    events = stores.jobs.events(job.id)
    assert [e.sequence for e in events] == list(range(1, 32))
    assert {e.data["i"] for e in events[1:]} == set(range(30))


def test_a_key_makes_one_job(stores: Stores, new_job: NewJob) -> None:
    key = Idempotency("k-1", "fingerprint")
    first = stores.jobs.add(new_job(), key)
    assert stores.jobs.add(new_job(), key) == first
    assert len(stores.jobs.list().items) == 1
    with pytest.raises(IdempotencyConflict, match="k-1"):
        stores.jobs.add(new_job(), Idempotency("k-1", "another"))


def test_a_key_used_by_many_at_once_makes_one_job(stores: Stores, new_job: NewJob) -> None:
    jobs = [new_job() for _ in range(8)]
    with ThreadPoolExecutor(8) as clients:
        made = set(clients.map(lambda job: stores.jobs.add(job, Idempotency("k", "f")).id, jobs))
    assert len(made) == 1
    assert [job.id for job in stores.jobs.list().items] == list(made)


def test_a_failed_add_does_not_use_up_its_key(stores: Stores, new_job: NewJob) -> None:
    key = Idempotency("k", "f")
    with pytest.raises(StorageFailure):
        stores.jobs.add(new_job(labels={"x": float("inf")}), key)
    job = new_job()
    assert stores.jobs.add(job, key) == replace(job, number=1)


def test_an_id_cannot_be_used_twice(stores: Stores, new_job: NewJob) -> None:
    job = stores.jobs.add(new_job(id=new_id()))
    with pytest.raises(StorageFailure):
        stores.jobs.add(job)


def test_jobs_are_listed_newest_first_filtered_and_counted(stores: Stores, new_job: NewJob) -> None:
    made = [
        stores.jobs.add(
            new_job(
                state=JobState.QUEUED if i % 2 else JobState.SUCCEEDED,
                unit=f"U-{i % 3}",
                procedure="thermal" if i % 5 == 0 else "static_run",
            )
        )
        for i in range(11)
    ]
    seen: list[Job] = []
    cursor = None
    while True:
        page = stores.jobs.list(after=cursor, limit=4)
        seen += page.items
        cursor = page.next
        if cursor is None:
            break
    assert seen == made[::-1]
    assert stores.jobs.list(limit=11).next is None
    assert stores.jobs.list(state=JobState.QUEUED).items == tuple(made[1::2][::-1])
    assert stores.jobs.list(unit="U-1", procedure="static_run").items == (made[7], made[4], made[1])
    assert stores.jobs.counts() == {s: {"queued": 5, "succeeded": 6}.get(s.value, 0) for s in JobState}
