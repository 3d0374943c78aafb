"""Batches of analyses in memory: claims, ends, orphans, cancel and retry, on both databases."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from bench_service.campaigns.stores import Stores
from bench_service.evidence.batches.service import grouped
from bench_service.model.batches import AnalysisBatch, BatchState, ClaimedTask, Grouping, Selection, TaskState
from bench_service.model.errors import IdempotencyConflict, IllegalTransition, NotFound
from bench_service.model.job import Failure
from bench_service.model.records import Idempotency, NewRecording
from bench_service.model.search import Search
from bench_service.persistence import open_stores
from bench_service.persistence.evidence.worker_names import SqlWorkerNames
from bench_service.wall_clock import new_id
from tests.kit.white_recordings import CHANNEL, store_white

NOW = datetime(2026, 11, 30, 12, tzinfo=UTC)
WHY = Failure("StorageFailure", "the database was away")


@pytest.fixture
def stores(database_url: str) -> Iterator[Stores]:
    opened, database = open_stores(database_url)
    yield opened
    database.dispose()


def recorded(stores: Stores, count: int, unit: str = "IMU-1") -> list[str]:
    return store_white(stores, count, 5, unit)


def batch(total: int, priority: int = 10, **more: object) -> AnalysisBatch:
    given = {"method": "allan_deviation", "version": "1", "selection": {}, "requested_by": "", "created_at": NOW}
    return AnalysisBatch(id=new_id(), total=total, priority=priority, **{**given, **more})


def added(stores: Stores, count: int, priority: int = 10) -> AnalysisBatch:
    ids = recorded(stores, count)
    return stores.batches.add(batch(count, priority), [(one,) for one in ids])


def claimed(stores: Stores, worker: str = "w.1", at: datetime = NOW) -> ClaimedTask:
    task = stores.batches.claim(worker, at)
    assert task is not None
    return task


def test_a_selection_finds_complete_recordings_only_and_ids_are_one_more_condition(stores: Stores) -> None:
    mine, others = recorded(stores, 2), recorded(stores, 1, "IMU-2")
    half = stores.recordings.open(NewRecording("IMU-1", (CHANNEL,), 100.0, 0.0, True))
    half.write(np.zeros((600_000, 1), dtype=np.int32))  # a chunk of it is committed
    assert [r for r, _, _ in stores.batches.select(Selection(unit="IMU-1"), 10)] == mine
    assert [r for r, _, _ in stores.batches.select(Selection(ids=(*mine[1:], *others)), 10)] == [*mine[1:], *others]
    assert stores.batches.select(Selection(unit="IMU-1", ids=tuple(others)), 10) == ()
    assert len(stores.batches.select(Selection(), 2)) == 2
    assert stores.batches.select(Selection(search=Search(until=datetime(2020, 1, 1, tzinfo=UTC))), 10) == ()
    assert stores.batches.select(Selection(procedure="static_run"), 10) == ()


def test_recordings_are_grouped_in_the_order_of_the_first_of_each_group() -> None:
    found = [("a", "j1", "u1"), ("b", None, "u2"), ("c", "j1", "u1"), ("d", "j2", "u1")]
    assert grouped(found, Grouping.RECORDING) == [("a",), ("b",), ("c",), ("d",)]
    assert grouped(found, Grouping.JOB) == [("a", "c"), ("b",), ("d",)]
    assert grouped(found, Grouping.UNIT) == [("a", "c", "d"), ("b",)]


def test_smaller_priorities_go_first_and_a_batch_keeps_the_order_of_its_tasks(stores: Stores) -> None:
    later, first = added(stores, 2, priority=20), added(stores, 2, priority=5)
    order = [(task.batch, task.number) for task in (claimed(stores) for _ in range(4))]
    assert order == [(first.id, 0), (first.id, 1), (later.id, 0), (later.id, 1)]
    assert stores.batches.claim("w.1", NOW) is None


def test_a_batch_ends_with_its_last_task_and_then_counts_nothing(stores: Stores) -> None:
    made = added(stores, 3)
    assert stores.batches.get(made.id).state is BatchState.WAITING
    first = claimed(stores)
    assert stores.batches.get(made.id).state is BatchState.RUNNING
    assert stores.batches.end(first, "w.1", TaskState.FAILED, NOW, failure=WHY)
    for _ in range(2):
        assert stores.batches.end(claimed(stores), "w.1", TaskState.DONE, NOW)
    ended = stores.batches.list().items[0]
    assert (ended.state, ended.ended_at) == (BatchState.FAILED, NOW)
    assert ended.counts == {TaskState.FAILED: 1, TaskState.DONE: 2}
    (failed,) = stores.batches.tasks(made.id, state=TaskState.FAILED)
    assert (failed.failure, failed.number, len(failed.recordings)) == (WHY, 0, 1)
    assert [task.number for task in stores.batches.tasks(made.id, after=0)] == [1, 2]


def test_no_task_is_claimed_twice_by_workers_at_once(stores: Stores) -> None:
    added(stores, 40)

    def take_all(worker: str) -> list[int]:
        taken: list[int] = []
        while (task := stores.batches.claim(worker, NOW)) is not None:
            taken.append(task.number)
        return taken

    with ThreadPoolExecutor(4) as pool:
        taken = [number for part in pool.map(take_all, ["w.1", "w.2", "w.3", "w.4"]) for number in part]
    assert sorted(taken) == list(range(40))


def test_tasks_of_a_dead_worker_go_back_until_they_were_claimed_too_often(stores: Stores) -> None:
    made = added(stores, 1)
    for attempt in (1, 2):
        task = claimed(stores, "dead.1")
        assert task.attempt == attempt
        assert stores.batches.claimants() == ("dead.1",)
        assert stores.batches.orphaned("dead.1", 3, NOW) == 1
        assert not stores.batches.end(task, "dead.1", TaskState.DONE, NOW), "its claim is lost"
    claimed(stores, "dead.1")
    assert stores.batches.orphaned("dead.1", 3, NOW) == 1
    (task,) = stores.batches.tasks(made.id)
    assert (task.state, task.failure.kind if task.failure else "") == (TaskState.FAILED, "WorkerEnded")
    assert stores.batches.get(made.id).state is BatchState.FAILED
    assert stores.batches.orphaned("dead.1", 3, NOW) == 0


def test_a_failure_that_may_pass_waits_for_its_pause_and_an_ordered_end_spends_no_attempt(stores: Stores) -> None:
    added(stores, 1)
    due = NOW + timedelta(seconds=2)
    assert stores.batches.put_back(claimed(stores), "w.1", due, WHY)
    assert stores.batches.claim("w.1", NOW) is None
    again = claimed(stores, at=due)
    assert again.attempt == 2
    assert stores.batches.put_back(again, "w.1", None, WHY, spent=False)
    assert claimed(stores).attempt == 2


def test_cancelled_tasks_are_not_claimed_and_a_retry_takes_failed_and_cancelled_ones(stores: Stores) -> None:
    made = added(stores, 4)
    failing, running = claimed(stores), claimed(stores)
    stores.batches.end(failing, "w.1", TaskState.FAILED, NOW, failure=WHY)
    with pytest.raises(IllegalTransition, match="has not ended"):
        stores.batches.retry(made.id, NOW)
    cancelled = stores.batches.cancel(made.id, "Ada", NOW)
    assert (cancelled.state, cancelled.cancelled_by) == (BatchState.CANCELLING, "Ada")
    assert stores.batches.claim("w.1", NOW) is None
    assert stores.batches.put_back(running, "w.1", None, WHY), "which cancels it, too"
    assert stores.batches.get(made.id).state is BatchState.CANCELLED
    with pytest.raises(IllegalTransition, match="has ended"):
        stores.batches.cancel(made.id, "Ada", NOW)
    again = stores.batches.retry(made.id, NOW)
    assert (again.state, again.counts) == (BatchState.WAITING, {TaskState.WAITING: 4})
    for _ in range(4):
        stores.batches.end(claimed(stores), "w.1", TaskState.DONE, NOW)
    with pytest.raises(IllegalTransition, match="no failed or cancelled"):
        stores.batches.retry(made.id, NOW)


def test_a_key_makes_one_batch(stores: Stores) -> None:
    ids = recorded(stores, 1)
    key = Idempotency("batches:k", "same")
    first = stores.batches.add(batch(1), [tuple(ids)], key)
    assert stores.batches.add(batch(1), [tuple(ids)], key).id == first.id
    with pytest.raises(IdempotencyConflict):
        stores.batches.add(batch(1), [tuple(ids)], Idempotency("batches:k", "another"))
    with pytest.raises(NotFound):
        stores.batches.get("nothing")


def test_a_name_is_held_by_one_worker_and_free_when_it_is_given_back(database_url: str) -> None:
    _, database = open_stores(database_url)
    names = SqlWorkerNames(database, database_url)
    first, second = names.take(), names.take()
    assert first.name != second.name
    assert names.alive(first.name)
    first.release()
    assert not names.alive(first.name)
    third = names.take()
    assert third.name == first.name
    for held in (second, third):
        held.release()
    database.dispose()
