"""The entry of a stop into the database by several processes, of which each may die or meet a failure anywhere."""

from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta

import pytest

from bench_service.bench.stop.exchange import LATE_S
from bench_service.bench.stop.word import StopWord
from bench_service.campaigns.stores import Stores
from bench_service.jobs.stop_entry import StopEntry
from bench_service.model.errors import StorageFailure
from bench_service.model.job import Job, JobState
from bench_service.telemetry.audit import AuditEntry
from bench_service.wall_clock import now

LATE = timedelta(seconds=LATE_S + 5.0)


class FailingOnce:
    """A store whose verb of one name fails at its first call, as with a database that goes away in between."""

    def __init__(self, store: object, verb: str) -> None:
        self._store = store
        self._verb = verb
        self._failed = False

    def __getattr__(self, name: str) -> object:
        if name == self._verb and not self._failed:
            self._failed = True
            return self._fail
        return getattr(self._store, name)

    def _fail(self, *_: object, **__: object) -> object:
        raise StorageFailure("the database is away")


def entry(stores: Stores, **changed: object) -> StopEntry:
    of = {"benches": stores.benches, "queue": stores.queue, "jobs": stores.jobs, "trail": stores.audit, **changed}
    return StopEntry(**of)  # pyright: ignore[reportArgumentType]


def noted(stores: Stores) -> list[AuditEntry]:
    return [one for one in stores.audit.list().items if (one.action, one.outcome) == ("stop", "noted")]


def claimed(stores: Stores, job: Job) -> Job:
    stores.jobs.add(job)
    found = stores.queue.look(job.bench, now()).next()
    assert found is not None
    running = stores.queue.claim(found, {}, now())
    assert running is not None
    return running


@pytest.fixture
def running(stores: Stores, new_job: Callable[..., Job]) -> Job:
    return claimed(stores, new_job(bench="sim"))


@pytest.mark.parametrize(
    ("store", "verb"),
    [("jobs", "request_cancel"), ("trail", "add_once"), ("queue", "running"), ("benches", "stop_bench")],
)
def test_a_failure_in_the_middle_of_an_entry_loses_nothing(stores: Stores, running: Job, store: str, verb: str) -> None:
    """The next attempt, here by another process, does the rest: the job's end and the entry about the delay."""
    word = StopWord("smoke", "Olena", "http", at=now() - LATE)
    real = {"benches": stores.benches, "queue": stores.queue, "jobs": stores.jobs, "trail": stores.audit}[store]
    with pytest.raises(StorageFailure):
        entry(stores, **{store: FailingOnce(real, verb)}).enter("sim", word)
    assert entry(stores).enter("sim", word) == running.id
    assert [stop.id for stop in stores.benches.standing_stops("sim")] == [word.id]
    assert stores.jobs.get(running.id).cancel_requested
    (note,) = (event.data for event in stores.jobs.events(running.id) if event.data.get("cancel_requested"))
    assert (note["by"], note["reason"]) == ("Olena", "stop of bench sim: smoke")
    (late,) = noted(stores)
    assert late.detail["stop"] == word.id
    assert late.detail["late_s"] >= LATE.total_seconds()


def test_an_entry_that_is_repeated_later_says_when_the_stop_was_entered_not_when_it_was_repeated(
    stores: Stores,
) -> None:
    """A stop that the database took in time is not late because another process enters it again after seconds."""
    asked = StopWord("smoke", "Olena", "http", at=now())
    entry(stores).enter("sim", asked)
    earlier = replace(asked, at=asked.at - LATE)  # as if the repetition came so much later
    (stop,) = stores.benches.standing_stops("sim")
    assert stop.entered_at is not None
    entry(stores).enter("sim", asked)
    assert noted(stores) == []
    entry(stores).enter("sim", earlier)
    (late,) = noted(stores)
    assert late.detail["late_s"] == pytest.approx((stop.entered_at - earlier.at).total_seconds())
    entry(stores).enter("sim", earlier)
    assert len(noted(stores)) == 1


def test_an_entry_that_is_completed_after_the_release_ends_no_job_of_later(
    stores: Stores, new_job: Callable[..., Job]
) -> None:
    word = StopWord("smoke", "Olena", "http", at=now())
    entry(stores).enter("sim", word)
    stores.benches.release_stop("sim", word.id, now(), "Ivan", "looked at")
    job = claimed(stores, new_job(bench="sim"))
    assert entry(stores).enter("sim", word) is None
    later = stores.jobs.get(job.id)
    assert (later.state, later.cancel_requested) == (JobState.RUNNING, False)


@pytest.mark.parametrize("text", ["Pr\udcfcfstand brennt", "a \ud83d", "NUL \0 within"])
def test_a_reason_with_characters_that_no_database_holds_is_stored_with_escapes(stores: Stores, text: str) -> None:
    """As `bench stop --reason` gives it on a terminal of another encoding: an entry that fails is never released."""
    word = StopWord(text, "\udcff on a host", "command", at=now() - LATE)
    entry(stores).enter("sim", word)
    (stop,) = stores.benches.standing_stops("sim")
    assert stop.id == word.id
    assert stop.reason.isprintable()
    assert stop.reason[0] == text[0]
    assert len(noted(stores)) == 1
