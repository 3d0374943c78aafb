"""A method of a campaign is worked out beside the conductor: it holds nobody up, and a kill leaves one result."""

from collections.abc import Callable, Iterator
from datetime import timedelta
from threading import Event
from typing import Any

import pytest

from bench_service.campaigns import conductor as conducting
from bench_service.campaigns.conductor import Conductor
from bench_service.campaigns.run import CampaignRun, StepState
from bench_service.campaigns.stores import Stores
from bench_service.evidence.analyses import AnalysisRequest, AnalysisService
from bench_service.model.errors import StorageFailure
from bench_service.model.job import Job, JobState
from bench_service.model.records import Idempotency, StoredResult
from bench_service.model.request import fingerprint
from bench_service.persistence import Database
from bench_service.wall_clock import monotonic_s, now, pause
from procedures.core.errors import UnfitRecording
from procedures.core.limits import Verdict
from tests.kit.fuse import Fuse, Killed, positions
from tests.storage.campaigns import Laboratory, campaign, new_run

METHOD = {"procedure": None, "method": "run_to_run", "calibrations_of": ["a"]}
NewResult = Callable[..., StoredResult]


@pytest.fixture
def laboratory(stores: Stores, new_job: Callable[..., Job]) -> Laboratory:
    return Laboratory(stores, new_job)


class SlowMethod:
    """A method that is worked out when a test says so."""

    def __init__(self, stores: Stores, new_result: NewResult, patch: pytest.MonkeyPatch) -> None:
        self.begun, self.go_on = Event(), Event()
        self.asked = self.over = 0
        self.fails: list[Exception] = []
        self.touch: Callable[[], None] = lambda: None
        """Called before and after the result is stored."""

        def run(_: AnalysisService, request: AnalysisRequest, key: str) -> StoredResult:
            self.asked += 1
            try:
                return work_out(request, key)
            finally:
                self.over += 1

        def work_out(request: AnalysisRequest, key: str) -> StoredResult:
            self.begun.set()
            assert self.go_on.wait(60)
            if self.fails:
                raise self.fails.pop(0)
            self.touch()
            made = new_result(kind="method", name="run_to_run", document={"checks": [], "warnings": []})
            stored = stores.results.add(made, (), False, Idempotency(f"analyses:{key}", fingerprint(request)))
            self.touch()
            return stored

        patch.setattr(AnalysisService, "run_method", run)


@pytest.fixture
def method(stores: Stores, new_result: NewResult, monkeypatch: pytest.MonkeyPatch) -> Iterator[SlowMethod]:
    slow = SlowMethod(stores, new_result, monkeypatch)
    yield slow
    slow.go_on.set()
    until(lambda: slow.over == slow.asked)  # the database is closed next


def until(reached: Callable[[], bool], seconds: float = 20.0) -> None:
    deadline = monotonic_s() + seconds
    while not reached():
        assert monotonic_s() < deadline
        pause(0.01)


def at_its_method(laboratory: Laboratory, method: SlowMethod, **more: Any) -> tuple[Conductor, CampaignRun]:
    """A run whose first step is done, and whose method is being worked out."""
    run = new_run(campaign({}, METHOD, **more))
    laboratory.stores.campaigns.add_run(run)
    conductor = laboratory.conductor()
    conductor.advance(run.id)
    laboratory.end(laboratory.jobs()[-1])
    conductor.advance(run.id)
    assert method.begun.wait(20)
    return conductor, run


def test_while_a_method_is_worked_out_other_runs_and_schedules_begin(
    laboratory: Laboratory, method: SlowMethod
) -> None:
    campaigns, looks = laboratory.stores.campaigns, [0]

    def fire() -> None:
        looks[0] += 1

    run, other = new_run(campaign({}, METHOD)), new_run(campaign({}), bench="sim2")
    campaigns.add_run(run)
    conductor = laboratory.conductor(fire)
    conductor.begin()
    try:
        until(lambda: len(laboratory.jobs()) == 1)
        laboratory.end(laboratory.jobs()[0])
        assert method.begun.wait(20)
        until(lambda: campaigns.run(run.id).steps[1].state is StepState.RUNNING)
        seen = looks[0]
        campaigns.add_run(other)
        until(lambda: len(laboratory.jobs()) == 2, 5)
        until(lambda: looks[0] > seen + 2, 5)
        assert laboratory.jobs()[-1].labels["campaign_run"] == other.id
        assert campaigns.run(run.id).open
        method.go_on.set()
        until(lambda: not campaigns.run(run.id).open, 5)
    finally:
        method.go_on.set()
        conductor.stop()
    ended = campaigns.run(run.id)
    assert (ended.verdict, ended.steps[1].state, method.asked) == (Verdict.PASS, StepState.SUCCEEDED, 1)


def test_a_run_that_is_cancelled_or_out_of_time_does_not_wait_for_its_method(
    laboratory: Laboratory, method: SlowMethod, monkeypatch: pytest.MonkeyPatch
) -> None:
    conductor, run = at_its_method(laboratory, method, window_h=1.0)
    conductor.advance(run.id)
    assert laboratory.stores.campaigns.run(run.id).open
    monkeypatch.setattr(conducting, "now", lambda: now() + timedelta(hours=2))
    conductor.advance(run.id)
    ended = laboratory.stores.campaigns.run(run.id)
    assert (ended.state, ended.verdict) == (JobState.FAILED, Verdict.ERROR)
    assert "window of 1 h" in ended.reason


@pytest.mark.parametrize(
    ("failure", "verdict"), [(StorageFailure("the disk"), Verdict.PASS), (UnfitRecording("too short"), Verdict.ERROR)]
)
def test_what_a_method_fails_with_is_dealt_with_as_before(
    laboratory: Laboratory, method: SlowMethod, failure: Exception, verdict: Verdict
) -> None:
    """A database that does not answer is asked again; evidence that does not fit never will."""
    method.fails = [failure]
    conductor, run = at_its_method(laboratory, method)
    method.go_on.set()
    campaigns = laboratory.stores.campaigns

    def over() -> bool:
        conductor.look()
        return not campaigns.run(run.id).open

    until(over)
    ended = campaigns.run(run.id)
    assert ended.verdict is verdict
    assert method.asked == (2 if verdict is Verdict.PASS else 1)
    assert (str(failure) in ended.steps[1].reason) == (verdict is Verdict.ERROR)


def test_killed_at_every_touch_there_is_one_result(
    laboratory: Laboratory, database: Database, method: SlowMethod, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also in the middle of the method: then its thread says nothing any more, and another process goes on."""
    campaigns, results = laboratory.stores.campaigns, laboratory.stores.results
    method.go_on.set()
    fuse, at = Fuse(0), 0
    for known, at in enumerate(positions(database)):
        run, fuse = new_run(campaign({}, METHOD)), Fuse(at)
        campaigns.add_run(run)
        conduct(laboratory, method, run.id, fuse, monkeypatch)
        ended = campaigns.run(run.id)
        assert (ended.state, ended.verdict) == (JobState.SUCCEEDED, Verdict.PASS)
        made = [result.id for result in results.list(limit=500).items if result.kind == "method"]
        assert len(made) == known + 1
        assert ended.steps[1].result_id == made[0]
        if not fuse.blown:
            break
    assert not fuse.blown
    assert at >= 8


def conduct(
    laboratory: Laboratory, method: SlowMethod, run_id: str, fuse: Fuse, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Conduct to the end with processes of which one is killed, in its conductor or in its method."""
    silent = Event()
    try:
        lives(laboratory, method, run_id, fuse, monkeypatch, silent)
    finally:
        silent.set()


def lives(
    laboratory: Laboratory,
    method: SlowMethod,
    run_id: str,
    fuse: Fuse,
    monkeypatch: pytest.MonkeyPatch,
    silent: Event,
) -> None:
    """One process after the other; a method of one that was killed says nothing before `silent` is over."""
    campaigns = laboratory.stores.campaigns
    for _ in range(3):
        dead = Event()

        def touch(dead: Event = dead) -> None:
            fuse.left -= 1
            if fuse.left == 0:
                fuse.blown = True
                dead.set()
                silent.wait(60)
                raise UnfitRecording("nobody hears this")

        method.touch = touch
        with monkeypatch.context() as patched:
            patched.setattr(campaigns, "save_run", fuse.around(campaigns.save_run))
            conductor = laboratory.conductor()
            patched.setattr(conductor, "_submit", fuse.around(conductor._submit))
            try:
                while campaigns.run(run_id).open and not dead.is_set():
                    conductor.advance(run_id)
                    for job in laboratory.jobs():
                        if job.state is JobState.QUEUED:
                            laboratory.end(job)
                    pause(0.002)
            except Killed:
                continue
        if not campaigns.run(run_id).open:
            return
    raise AssertionError(campaigns.run(run_id))
