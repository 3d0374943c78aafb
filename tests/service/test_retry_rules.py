"""Which failures put a job back into the queue, when it may start again, and what that costs it."""

from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any

import pytest

from bench_service.jobs import retries
from bench_service.model.job import Failure

NOW = datetime(2031, 5, 6, 7, 8, 9, tzinfo=UTC)


class Queue:
    """Notes what is asked of it: pause [s], failure, and whether a retry is spent."""

    def __init__(self) -> None:
        self.asked: list[tuple[float, Failure, bool]] = []

    def requeue(self, job_id: str, at: datetime, not_before: datetime, why: Failure, spend: bool) -> str:
        assert (job_id, at) == ("a job", NOW)
        self.asked.append(((not_before - at).total_seconds(), why, spend))
        return "requeued"


@pytest.fixture
def queue(monkeypatch: pytest.MonkeyPatch) -> Queue:
    monkeypatch.setattr(retries, "now", lambda: NOW)
    return Queue()


def tried(queue: Queue, failure: Failure | None, scale: float = 1.0, **job: int) -> Any:
    """Answer of the retry rule to a job's failure."""
    given = {"retries": 0, "retries_left": 0, "attempt": 1, **job}
    return retries.try_again(queue, SimpleNamespace(id="a job", **given), failure, scale)  # pyright: ignore[reportArgumentType]


FAULT = Failure("Disconnected", "the table does not answer")


@pytest.mark.parametrize(("left", "pause_s"), [(7, 10.0), (6, 30.0), (5, 60.0), (4, 120.0), (3, 300.0), (1, 300.0)])
def test_a_fault_of_the_bench_costs_a_retry_and_pauses_longer_each_time(
    queue: Queue, left: int, pause_s: float
) -> None:
    assert tried(queue, FAULT, retries=7, retries_left=left) == "requeued"
    assert queue.asked == [(pause_s, FAULT, True)]


@pytest.mark.parametrize("kind", ["StorageFailure", "LeaseLost"])
def test_a_restarted_database_costs_no_retry_until_the_last_attempt(queue: Queue, kind: str) -> None:
    failure = Failure(kind, "the database is away")
    assert tried(queue, failure, attempt=19) == "requeued"
    assert queue.asked == [(1.0, failure, False)]
    assert [tried(queue, failure, attempt=most) for most in (20, 21)] == [None, None]
    assert len(queue.asked) == 1


def test_pauses_of_the_bench_are_scaled_and_those_of_the_database_are_not(queue: Queue) -> None:
    tried(queue, FAULT, 0.5, retries=1, retries_left=1)
    tried(queue, Failure("LeaseLost", "x"), 0.5)
    assert [pause_s for pause_s, _, _ in queue.asked] == [5.0, 1.0]


@pytest.mark.parametrize(
    ("failure", "left"),
    [(None, 3), (FAULT, 0), (Failure("BadParameter", "x"), 3), (Failure("ValueError", "x"), 3)],
)
def test_a_job_ends_without_failure_without_a_retry_left_and_where_it_would_fail_again(
    queue: Queue, failure: Failure | None, left: int
) -> None:
    assert tried(queue, failure, retries=3, retries_left=left) is None
    assert queue.asked == []
