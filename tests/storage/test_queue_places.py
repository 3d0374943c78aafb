"""All places of a queue at once, and its front alone, say what a walk from the front says for each job."""

from collections.abc import Callable
from datetime import timedelta

from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import event

from bench_service.campaigns.stores import Stores
from bench_service.jobs.queue import BenchQueue, Place, QueueEntry
from bench_service.jobs.reservation import Reservation, Reserved
from bench_service.model.job import Job, JobState
from bench_service.model.records import BenchStop
from bench_service.persistence import Database
from bench_service.persistence.jobs.queue_store import FIRST_PAGE, LONGER
from bench_service.wall_clock import new_id
from tests.stops import release_all
from tests.storage.conftest import NOW

SECOND = timedelta(seconds=1)
SOON = st.integers(-5, 400).map(lambda seconds: NOW + seconds * SECOND)
"""Over, due, put off, and put off for longer than a retry ever is."""
RESERVATIONS = st.lists(
    st.builds(
        Reservation,
        id=st.sampled_from(["R-1", "R-2", "R-3"]),
        kind=st.sampled_from(Reserved),
        name=st.sampled_from(["sim", "U-1", "U-2"]),
        holder=st.sampled_from(["Ann", "Bob"]),
        created_at=st.just(NOW),
        until=st.just(NOW + 60 * SECOND),
    ),
    max_size=3,
    unique_by=lambda kept: kept.id,
)
ENTRIES = st.lists(
    st.builds(
        QueueEntry,
        id=st.integers(0, 99).map("job {}".format),
        procedure=st.just("static_run"),
        unit=st.sampled_from(["U-1", "U-2"]),
        priority=st.integers(1, 3),
        queued_at=SOON,
        attempt=st.just(1),
        not_before=st.none() | SOON,
        reservation=st.none() | st.sampled_from(["R-1", "R-2", "R-3", "one that is over"]),
    ),
    max_size=12,
    unique_by=lambda entry: entry.id,
)


@st.composite
def queues(draw: st.DrawFn) -> BenchQueue:
    return BenchQueue(
        bench="sim",
        at=NOW,
        entries=tuple(sorted(draw(ENTRIES), key=lambda entry: (entry.priority, entry.queued_at, entry.id))),
        running=draw(st.none() | st.just("the running one")),
        stops=draw(st.just(()) | st.just((BenchStop("sim", NOW, "smoke"),))),
        reservations=tuple(draw(RESERVATIONS)),
    )


def walked(queue: BenchQueue, job_id: str, driven: bool) -> Place:
    """Where one job stands, found by a walk from the front up to it."""
    ahead = [] if queue.running is None else [queue.running]
    for number, entry in enumerate(queue.entries, start=1):
        hold = queue.hold(entry)
        if entry.id == job_id:
            if hold is not None:
                waiting = hold
            elif not driven:
                waiting = "no worker drives bench sim now"
            elif not ahead:
                waiting = "it is next"
            elif ahead == [queue.running]:
                waiting = f"behind job {queue.running}, which runs"
            else:
                waiting = f"behind {len(ahead)} jobs; the last of them is {ahead[-1]}"
            return Place(number, len(ahead), waiting)
        if hold is None:
            ahead.append(entry.id)
    raise AssertionError(f"{job_id} is not in the queue")


@given(queue=queues(), driven=st.booleans())
def test_all_places_at_once_are_those_of_a_walk_for_each(queue: BenchQueue, driven: bool) -> None:
    expected = {entry.id: walked(queue, entry.id, driven) for entry in queue.entries}
    assert queue.places(driven) == expected
    assert list(queue.places(driven)) == [entry.id for entry in queue.entries]
    assert queue.place("not in it", driven) is None
    if queue.entries:
        last = queue.entries[-1].id
        assert queue.place(last, driven) == expected[last]


def test_all_places_hold_each_job_against_the_rules_once() -> None:
    class Counted(BenchQueue):
        held = 0

        def hold(self, entry: QueueEntry) -> str | None:
            Counted.held += 1
            return super().hold(entry)

    entries = tuple(QueueEntry(f"job {number}", "static_run", "U-1", 10, NOW, 1) for number in range(500))
    assert len(Counted("sim", NOW, entries).places(True)) == 500
    assert Counted.held == 500


def queued(stores: Stores, new_job: Callable[..., Job], number: int, **changes: object) -> list[Job]:
    return [stores.jobs.add(new_job(**{"queued_at": NOW + k * SECOND, **changes})) for k in range(number)]


def test_the_front_knows_the_next_job_however_many_are_passed_over(stores: Stores, new_job: Callable[..., Job]) -> None:
    """Over the edges of all pages: equal priorities and moments are told apart by their ids."""
    assert stores.queue.front("sim", NOW) == BenchQueue("sim", NOW, ())
    put_off = NOW + 60 * SECOND
    for number in (FIRST_PAGE - 1, 1, FIRST_PAGE * (LONGER - 1), FIRST_PAGE * LONGER):
        queued(stores, new_job, number, queued_at=NOW, not_before=put_off)
        front = stores.queue.front("sim", NOW)
        assert front == stores.queue.look("sim", NOW), "nobody may start, so all were read"
        assert front.next() is None
    free = queued(stores, new_job, FIRST_PAGE * LONGER * 2 + 1)  # one more than the third page ends with
    look, front = stores.queue.look("sim", NOW), stores.queue.front("sim", NOW)
    assert front.next() == look.next()
    assert front.entries == look.entries[: len(front.entries)]
    assert len(front.entries) < len(look.entries)
    assert next(entry.id for entry in front.entries if front.hold(entry) is None) == free[0].id


def test_the_front_is_read_only_as_far_as_it_must_be(stores: Stores, new_job: Callable[..., Job]) -> None:
    jobs = queued(stores, new_job, FIRST_PAGE + 5)
    front = stores.queue.front("sim", NOW)
    assert [entry.id for entry in front.entries] == [job.id for job in jobs[:FIRST_PAGE]]
    stores.benches.stop_bench(BenchStop("sim", NOW, "smoke"))
    stopped = stores.queue.front("sim", NOW)
    assert (len(stopped.entries), stopped.next()) == (FIRST_PAGE, None)
    assert stopped.stops == stores.queue.look("sim", NOW).stops
    release_all(stores.benches, "sim")
    assert stores.queue.claim(front.entries[0], {}, NOW) is not None
    assert stores.queue.front("sim", NOW) == BenchQueue("sim", NOW, (), running=jobs[0].id)


def test_a_claim_reads_its_own_job_and_the_running_one_and_no_other(
    database: Database, stores: Stores, new_job: Callable[..., Job]
) -> None:
    kept = stores.reservations.add(Reservation(new_id(), Reserved.BENCH, "sim", "Ann", NOW, NOW + 60 * SECOND))
    theirs = queued(stores, new_job, 3)[0]
    hers = queued(stores, new_job, 1, reservation=kept.id)[0]
    entries = {entry.id: entry for entry in stores.queue.look("sim", NOW).entries}
    asked: list[str] = []
    event.listen(database.engine, "before_cursor_execute", lambda _connection, _cursor, sql, *_: asked.append(sql))
    assert stores.queue.claim(entries[theirs.id], {}, NOW) is None, "the bench is Ann's"
    claimed = stores.queue.claim(entries[hers.id], {}, NOW)
    assert claimed is not None
    assert claimed.state is JobState.RUNNING
    assert stores.queue.claim(entries[theirs.id], {}, NOW + 61 * SECOND) is None, "hers runs"
    of_jobs = [sql for sql in asked if "FROM jobs" in sql]
    assert len(of_jobs) >= 6
    assert [sql for sql in of_jobs if "jobs.id = " not in sql and "LIMIT" not in sql] == []
