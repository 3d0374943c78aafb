"""A job that another version stored in words that this one does not know: it holds up no queue and no list."""

import logging
from collections.abc import Callable

import pytest
import sqlalchemy as sa

from bench_service.campaigns.stores import Stores
from bench_service.cli.asking.client import connect
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.jobs.dispatcher import Dispatcher, Unfinished
from bench_service.jobs.queue import QueueEntry
from bench_service.model.errors import IllegalTransition, NotUnderstood
from bench_service.model.job import Failure, Job, JobState
from bench_service.model.records import Page
from bench_service.persistence import Database
from bench_service.persistence.tables.jobs import JobRow
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.storage.conftest import NOW

NewJob = Callable[..., Job]
STATIONS = [{"index_of_a_later_version": 0, "label": "x"}]
UNREADABLE = {
    "stations": STATIONS,
    "failure": {"sort": "NotSettled"},
    "verdict": "perhaps",
}


@pytest.fixture(params=sorted(UNREADABLE))
def spoil(request: pytest.FixtureRequest, database: Database) -> Callable[[Job], Job]:
    """Put words that nobody knows into one column of a stored job."""

    def spoiled(job: Job) -> Job:
        with database.write() as session:
            session.execute(
                sa.update(JobRow).where(JobRow.id == job.id).values({request.param: UNREADABLE[request.param]})
            )
        return job

    return spoiled


def state_of(stores: Stores, job: Job) -> JobState:
    return stores.jobs.last_event(job.id)[1]


def test_it_is_refused_in_one_sentence_that_names_it_and_its_version(
    stores: Stores, new_job: NewJob, spoil: Callable[[Job], Job]
) -> None:
    job = spoil(stores.jobs.add(new_job()))
    for ask in (stores.jobs.get, lambda i: stores.queue.set_priority(i, 5, NOW), lambda i: stores.jobs.resume(i, NOW)):
        with pytest.raises(NotUnderstood) as refusal:
            ask(job.id)
        assert f"job {job.id} was stored by version abc of the service" in str(refusal.value)
        assert "\n" not in str(refusal.value)
    assert state_of(stores, job) is JobState.QUEUED


def test_lists_leave_it_out_say_so_once_and_go_on_behind_it(
    stores: Stores, new_job: NewJob, spoil: Callable[[Job], Job], caplog: pytest.LogCaptureFixture
) -> None:
    made = [stores.jobs.add(new_job()) for _ in range(6)]
    foreign = [spoil(made[k]) for k in (1, 2, 5)]
    for _ in range(2):
        found: list[Job] = []
        page = Page[Job]((), "")
        pages = 0
        while page.next is not None:
            page = stores.jobs.list(after=page.next or None, limit=2)
            found += page.items
            pages += 1
        assert (pages, found) == (3, [made[4], made[3], made[0]])
    warnings = [record for record in caplog.records if record.levelno == logging.WARNING]
    texts = [record.getMessage() for record in warnings if record.name == "bench_service.persistence.jobs.job_store"]
    assert len(texts) == len(foreign), "another one than those of the foreign jobs"
    assert [sum(job.id in text for text in texts) for job in foreign] == [1, 1, 1]


def test_it_is_cancelled_like_any_other(stores: Stores, new_job: NewJob, spoil: Callable[[Job], Job]) -> None:
    for state, then in (
        (JobState.QUEUED, JobState.CANCELLED),
        (JobState.INTERRUPTED, JobState.CANCELLED),
        (JobState.RUNNING, JobState.RUNNING),
    ):
        job = spoil(stores.jobs.add(new_job(state=state)))
        with pytest.raises(NotUnderstood):
            stores.jobs.request_cancel(job.id, NOW)
        assert state_of(stores, job) is then
        assert stores.jobs.cancel_requested(job.id)
        if then is JobState.CANCELLED:
            with pytest.raises(IllegalTransition, match="it is cancelled"):
                stores.jobs.request_cancel(job.id, NOW)


def test_it_is_interrupted_with_the_reason_and_without_being_read(
    stores: Stores, new_job: NewJob, spoil: Callable[[Job], Job]
) -> None:
    job = spoil(stores.jobs.add(new_job()))
    stores.jobs.interrupt(job.id, NOW, Failure("NotUnderstood", "why"))
    assert stores.jobs.events(job.id)[-1].data == {
        "state": "interrupted",
        "before": "queued",
        "failure": {"kind": "NotUnderstood", "message": "why", "station": None},
    }
    assert stores.queue.look("sim", NOW).entries == ()


def test_a_state_of_another_version_is_refused_in_a_sentence(
    database: Database, stores: Stores, new_job: NewJob
) -> None:
    job = stores.jobs.add(new_job())
    with database.write() as session:
        session.execute(sa.update(JobRow).where(JobRow.id == job.id).values(state="dreaming"))
    for ask in (stores.jobs.get, lambda i: stores.jobs.request_cancel(i, NOW)):
        with pytest.raises(NotUnderstood, match="'dreaming' is not a valid JobState"):
            ask(job.id)
    assert stores.jobs.list().items == ()


class ReadingRunner:
    """Claims as the real one does, as far as a test without units can."""

    def __init__(self, stores: Stores) -> None:
        self._stores = stores

    def claim(self, entry: QueueEntry) -> Job | None:
        self._stores.jobs.get(entry.id)
        return self._stores.queue.claim(entry, {}, NOW)


class CancellingEngine:
    """Ends each job at once; of a running one it says what it was made to say."""

    def __init__(self, stores: Stores, found: Unfinished) -> None:
        self._stores = stores
        self._found = found

    def run(self, job: Job) -> None:
        self._stores.jobs.transition(job.id, JobState.CANCELLED, at=NOW)

    def unfinished(self, job: QueueEntry) -> Unfinished:
        return self._found


class SureLease:
    def held(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("state", "found"),
    [
        (JobState.QUEUED, Unfinished()),
        (JobState.RUNNING, Unfinished()),
        (JobState.RUNNING, Unfinished(gone=Failure("EngineGaveUp", "the job engine ended this job as SUCCESS"))),
    ],
)
def test_the_jobs_behind_it_run(
    stores: Stores, new_job: NewJob, spoil: Callable[[Job], Job], state: JobState, found: Unfinished
) -> None:
    """Whether it waits in front, or a process died that had begun it."""
    foreign = spoil(stores.jobs.add(new_job(state=state, priority=1)))
    behind = stores.jobs.add(new_job())
    runner, engine = ReadingRunner(stores), CancellingEngine(stores, found)
    dispatcher = Dispatcher("sim", stores, runner, engine, SureLease(), 0.01)  # pyright: ignore[reportArgumentType]
    dispatcher.begin()
    deadline = monotonic_s() + 20
    while state_of(stores, behind) is not JobState.CANCELLED:
        assert monotonic_s() < deadline, "it waits behind a job that nobody understands"
        pause(0.01)
    dispatcher.shut_down()
    assert state_of(stores, foreign) is JobState.INTERRUPTED
    failure = stores.jobs.events(foreign.id)[-1].data["failure"]
    assert failure["kind"] == "NotUnderstood"
    assert foreign.id in failure["message"]


def test_a_bench_that_runs_it_is_seen_and_stopped_all_the_same(
    database_url: str, stores: Stores, new_job: NewJob, spoil: Callable[[Job], Job]
) -> None:
    """As by an API beside a worker of another version."""
    job = spoil(stores.jobs.add(new_job(state=JobState.RUNNING)))
    stores.benches.put_bench(SimulatedDriver("sim").description, [])
    running = stores.queue.running("sim")
    assert running is not None
    assert (running.id, running.attempt, running.procedure, running.unit) == (job.id, 1, job.procedure, job.unit)
    with connect(Settings(database_url=database_url), None, drive=False) as http:
        (bench,) = http.get("/api/v1/benches").json()
        assert (bench["state"], bench["job"]) == ("busy", job.id)
        assert job.id in http.get("/").text
        stopping = http.post("/api/v1/benches/sim/stop", json={"reason": "smoke"})
        assert (stopping.status_code, stopping.json()["job"]) == (202, job.id)
    assert stores.benches.bench_stop("sim") is not None
    assert stores.jobs.cancel_requested(job.id)
