"""The queue of a bench: the order of picking, who waits and why, and that one job of a bench runs, whoever asks."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import timedelta

import pytest

from bench_service.campaigns.stores import Stores
from bench_service.jobs.reservation import Reservation, Reserved
from bench_service.model.errors import AlreadyReserved, IdempotencyConflict, IllegalTransition, NotFound
from bench_service.model.job import Failure, Job, JobState
from bench_service.model.records import BenchStop, Idempotency
from bench_service.persistence import Database
from bench_service.persistence.stores import stores_of
from bench_service.wall_clock import new_id
from tests.stops import release_all
from tests.storage.conftest import NOW

NewJob = Callable[..., Job]
SECOND = timedelta(seconds=1)
FAULT = Failure("NotSettled", "the table did not come to rest", 1)


def reservation(kind: Reserved, name: str, holder: str = "Ann", seconds: float = 60.0) -> Reservation:
    return Reservation(new_id(), kind, name, holder, NOW, NOW + seconds * SECOND)


def claim_next(stores: Stores, at_s: float = 0.0, bench: str = "sim") -> Job | None:
    at = NOW + at_s * SECOND
    entry = stores.queue.look(bench, at).next()
    return None if entry is None else stores.queue.claim(entry, {"met": "now"}, at)


def finish(stores: Stores, job: Job) -> str:
    stores.jobs.transition(job.id, JobState.SUCCEEDED, at=NOW)
    return job.id


def test_jobs_are_picked_by_priority_then_moment_then_id(stores: Stores, new_job: NewJob) -> None:
    keys = [(10, 3), (10, 1), (1, 9), (10, 1), (500, 0), (1, 2)]
    jobs = [stores.jobs.add(new_job(priority=p, queued_at=NOW + s * SECOND)) for p, s in keys]
    other = stores.jobs.add(new_job(priority=1, bench="other"))
    expected = [job.id for job in sorted(jobs, key=lambda job: (job.priority, job.queued_at, job.id))]
    picked: list[str] = []
    while (job := claim_next(stores, 100.0)) is not None:
        assert job.context == {"met": "now"}
        assert job.started_at == NOW + 100 * SECOND
        picked.append(finish(stores, job))
    assert picked == expected
    assert stores.queue.lengths() == {"other": 1}
    assert claim_next(stores, bench="other") == replace(
        other, state=JobState.RUNNING, context={"met": "now"}, started_at=NOW
    )


def test_a_job_that_may_not_start_yet_is_passed_over(stores: Stores, new_job: NewJob) -> None:
    later = stores.jobs.add(new_job(priority=1, not_before=NOW + 30 * SECOND))
    ready = stores.jobs.add(new_job(priority=900))
    queue = stores.queue.look("sim", NOW)
    place, behind = queue.place(later.id, True), queue.place(ready.id, True)
    assert place is not None
    assert (place.position, place.ahead) == (1, 0)
    assert place.waiting == f"it starts no earlier than {(NOW + 30 * SECOND).isoformat()}"
    assert behind is not None
    assert (behind.position, behind.ahead, behind.waiting) == (2, 0, "it is next")
    first = claim_next(stores)
    assert first is not None
    assert finish(stores, first) == ready.id
    assert claim_next(stores) is None
    due = claim_next(stores, 30.0)
    assert due is not None
    assert (due.id, due.not_before) == (later.id, None)


def test_a_place_says_what_is_ahead(stores: Stores, new_job: NewJob) -> None:
    first, second, third = (stores.jobs.add(new_job(queued_at=NOW + k * SECOND)) for k in range(3))
    running = claim_next(stores)
    assert running is not None
    assert running.id == first.id
    queue = stores.queue.look("sim", NOW)
    places = [queue.place(job.id, True) for job in (second, third)]
    assert [(p.position, p.ahead, p.waiting) for p in places if p] == [
        (1, 1, f"behind job {first.id}, which runs"),
        (2, 2, f"behind 2 jobs; the last of them is {second.id}"),
    ]
    undriven = queue.place(second.id, False)
    assert undriven is not None
    assert undriven.waiting == "no worker drives bench sim now"
    assert queue.place(first.id, True) is None


def test_a_stopped_bench_gives_no_job(stores: Stores, new_job: NewJob) -> None:
    job = stores.jobs.add(new_job())
    entry = stores.queue.look("sim", NOW).next()
    assert entry is not None
    stores.benches.stop_bench(BenchStop("sim", NOW, "smoke"))  # after it was chosen, before it was claimed
    assert stores.queue.claim(entry, {}, NOW) is None
    place = stores.queue.look("sim", NOW).place(job.id, True)
    assert place is not None
    assert place.waiting == "bench sim is stopped: smoke"
    assert claim_next(stores) is None
    release_all(stores.benches, "sim")
    assert claim_next(stores) is not None


def test_of_many_who_claim_one_gets_a_job_of_the_bench(database: Database, stores: Stores, new_job: NewJob) -> None:
    """Eight workers of one bench, which the lease should never allow: still one job runs at a time."""
    for _ in range(8):
        stores.jobs.add(new_job())
    entries = stores.queue.look("sim", NOW).entries
    with ThreadPoolExecutor(8) as workers:
        claimed = list(workers.map(lambda entry: stores_of(database).queue.claim(entry, {}, NOW), entries))
    assert sum(job is not None for job in claimed) == 1
    assert [job.state for job in stores.jobs.list().items].count(JobState.RUNNING) == 1


def test_a_job_that_was_queued_anew_is_not_claimed_as_it_was(stores: Stores, new_job: NewJob) -> None:
    job = stores.jobs.add(new_job())
    entry = stores.queue.look("sim", NOW).next()
    assert entry is not None
    stores.jobs.request_pause(job.id, NOW)
    assert stores.queue.claim(entry, {}, NOW) is None
    stores.jobs.resume(job.id, NOW)
    assert stores.queue.claim(entry, {}, NOW) is None
    again = claim_next(stores)
    assert again is not None
    assert again.attempt == 2


def test_a_retry_keeps_its_place_costs_one_and_waits(stores: Stores, new_job: NewJob) -> None:
    job = stores.jobs.add(new_job(queued_at=NOW, retries=2, retries_left=2))
    assert claim_next(stores) is not None
    due = NOW + 10 * SECOND
    again = stores.queue.requeue(job.id, NOW + SECOND, due, FAULT, spend=True)
    assert (again.state, again.attempt, again.retries_left) == (JobState.QUEUED, 2, 1)
    assert (again.queued_at, again.not_before) == (NOW, due)
    said = stores.jobs.events(job.id)[-1].data
    assert said["again_because"] == {"kind": "NotSettled", "message": FAULT.message, "station": 1}
    assert said["not_before"] == due.isoformat()
    with pytest.raises(IllegalTransition, match="is queued; only a running one"):
        stores.queue.requeue(job.id, NOW, None, FAULT, spend=True)
    assert claim_next(stores, 9.0) is None
    assert claim_next(stores, 10.0) is not None
    assert stores.queue.requeue(job.id, NOW, None, FAULT, spend=False).retries_left == 1


def test_a_wish_of_a_person_goes_before_a_retry(stores: Stores, new_job: NewJob) -> None:
    for wish, state in ((stores.jobs.request_cancel, JobState.CANCELLED), (stores.jobs.request_pause, JobState.PAUSED)):
        job = stores.jobs.add(new_job(state=JobState.RUNNING, retries_left=1))
        wish(job.id, NOW)
        assert stores.queue.requeue(job.id, NOW, None, FAULT, spend=True).state is state


def test_a_priority_changes_the_order_while_the_job_is_queued(stores: Stores, new_job: NewJob) -> None:
    jobs = [stores.jobs.add(new_job(queued_at=NOW + k * SECOND)) for k in range(3)]
    assert stores.queue.set_priority(jobs[2].id, 1, NOW).priority == 1
    assert [e.id for e in stores.queue.look("sim", NOW).entries] == [jobs[2].id, jobs[0].id, jobs[1].id]
    assert stores.jobs.events(jobs[2].id)[-1].data == {"priority": 1, "before": 10}
    assert claim_next(stores) is not None
    with pytest.raises(IllegalTransition, match="is running; only a queued one"):
        stores.queue.set_priority(jobs[2].id, 5, NOW)


@pytest.mark.parametrize(("kind", "name"), [(Reserved.BENCH, "sim"), (Reserved.UNIT, "U-1")])
def test_jobs_of_others_wait_until_a_reservation_ends(
    stores: Stores, new_job: NewJob, kind: Reserved, name: str
) -> None:
    kept = stores.reservations.add(reservation(kind, name))
    stores.reservations.add(reservation(kind, "another"))
    theirs = stores.jobs.add(new_job(priority=1))
    hers = stores.jobs.add(new_job(priority=900, reservation=kept.id))
    place = stores.queue.look("sim", NOW).place(theirs.id, True)
    assert place is not None
    assert place.waiting == f"{kind.value} {name} is reserved by Ann until {kept.until.isoformat()}"
    first = claim_next(stores)
    assert first is not None
    assert finish(stores, first) == hers.id
    assert claim_next(stores, 59.9) is None
    assert claim_next(stores, 60.0) is not None  # the end itself is free
    assert stores.reservations.list(active_at=NOW + 60 * SECOND).items == ()


def test_a_reservation_given_back_frees_at_once_and_its_job_becomes_an_ordinary_one(
    stores: Stores, new_job: NewJob
) -> None:
    kept = stores.reservations.add(reservation(Reserved.BENCH, "sim"))
    job = stores.jobs.add(new_job(reservation=kept.id))
    ended = stores.reservations.end(kept.id, NOW + SECOND)
    assert (ended.ended_at, ended.active(NOW + 2 * SECOND)) == (NOW + SECOND, False)
    assert stores.reservations.end(kept.id, NOW + 5 * SECOND) == ended
    assert claim_next(stores, 2.0) is not None
    text = stores.jobs.events(job.id)[1].data["text"]
    assert kept.id in text
    assert "ordinary job" in text
    stores.reservations.add(reservation(Reserved.BENCH, "sim", "Bob"))


def test_who_holds_bench_and_unit_uses_both_with_either(stores: Stores, new_job: NewJob) -> None:
    bench = stores.reservations.add(reservation(Reserved.BENCH, "sim"))
    stores.reservations.add(reservation(Reserved.UNIT, "U-1"))
    stores.reservations.add(reservation(Reserved.UNIT, "U-2", "Bob"))
    stores.jobs.add(new_job(reservation=bench.id, unit="U-2", priority=1))
    mine = stores.jobs.add(new_job(reservation=bench.id))
    job = claim_next(stores)
    assert job is not None
    assert job.id == mine.id
    finish(stores, job)
    assert claim_next(stores) is None, "the unit is Bob's"


def test_of_many_who_reserve_one_thing_one_gets_it(database: Database, stores: Stores) -> None:
    def ask(number: int) -> str:
        try:
            stores_of(database).reservations.add(reservation(Reserved.BENCH, "sim", f"holder {number}"))
        except AlreadyReserved as refusal:
            return str(refusal)
        return "given"

    with ThreadPoolExecutor(8) as askers:
        said = sorted(askers.map(ask, range(8)))
    assert [text for text in said if "is reserved by holder" not in text] == ["given"]
    assert len(stores.reservations.list().items) == 1


def test_reservations_are_kept_listed_and_made_once_for_a_key(stores: Stores) -> None:
    key = Idempotency("reservations:k", "f")
    first = stores.reservations.add(reservation(Reserved.UNIT, "U-1"), key)
    assert stores.reservations.add(reservation(Reserved.UNIT, "U-1"), key) == first
    with pytest.raises(IdempotencyConflict):
        stores.reservations.add(reservation(Reserved.UNIT, "U-9"), Idempotency("reservations:k", "g"))
    second = stores.reservations.add(reservation(Reserved.UNIT, "U-2", seconds=5.0))
    assert stores.reservations.get(first.id) == first
    assert stores.reservations.list().items == (second, first)
    assert stores.reservations.list(active_at=NOW + 5 * SECOND).items == (first,)
    assert stores.reservations.list(limit=1).next == second.id
    for ask in (stores.reservations.get, lambda i: stores.reservations.end(i, NOW)):
        with pytest.raises(NotFound, match="reservation 'x'"):
            ask("x")


def test_a_failed_job_is_resumed_where_its_fault_may_be_gone(stores: Stores, new_job: NewJob) -> None:
    for kind, again in (("NotSettled", True), ("LeaseLost", True), ("OutOfRange", False), ("Undetermined", False)):
        job = stores.jobs.add(new_job(state=JobState.RUNNING))
        failed = stores.jobs.transition(job.id, JobState.FAILED, at=NOW, failure=Failure(kind, "why", 1))
        assert failed.resumable is again
        if again:
            assert stores.jobs.resume(job.id, NOW).state is JobState.QUEUED
        else:
            with pytest.raises(IllegalTransition, match=rf"is failed \({kind}: why\); it cannot be resumed"):
                stores.jobs.resume(job.id, NOW)
    late = stores.jobs.add(new_job(state=JobState.RUNNING, deadline_at=NOW - SECOND))
    stores.jobs.transition(late.id, JobState.FAILED, at=NOW, failure=Failure("DeadlinePassed", "late", 0))
    assert stores.jobs.resume(late.id, NOW).deadline_at is None
    assert stores.jobs.events(late.id)[-1].data == {"deadline_lifted": (NOW - SECOND).isoformat()}


def test_jobs_of_a_teams_campaign_do_not_wait_for_what_that_team_has_reserved(stores: Stores, new_job: NewJob) -> None:
    stores.reservations.add(replace(reservation(Reserved.BENCH, "sim"), team="alpha"))
    strangers = [stores.jobs.add(new_job(priority=1, team=team)) for team in ("", "beta")]
    theirs = stores.jobs.add(new_job(priority=900, team="alpha"))
    claimed = claim_next(stores)
    assert claimed is not None
    assert claimed.id == theirs.id
    finish(stores, claimed)
    assert claim_next(stores) is None
    assert claim_next(stores, 61.0) == replace(
        strangers[0], state=JobState.RUNNING, context={"met": "now"}, started_at=NOW + 61 * SECOND
    )
