"""A conductor that dies at any of its touches of the world: another one goes on, and nothing is done twice."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from bench_service.campaigns.conductor import Conductor
from bench_service.campaigns.stores import Stores
from bench_service.model.job import Job, JobState
from bench_service.model.request import JobRequest
from bench_service.persistence import Database
from procedures.core.errors import BadParameter
from procedures.core.limits import Verdict
from tests.kit.fuse import Fuse, Killed, positions
from tests.storage.campaigns import Laboratory, campaign, new_run


def fragile(laboratory: Laboratory, fuse: Fuse, monkeypatch: pytest.MonkeyPatch) -> Conductor:
    campaigns = laboratory.stores.campaigns
    monkeypatch.setattr(campaigns, "save_run", fuse.around(campaigns.save_run))
    conductor = laboratory.conductor()
    monkeypatch.setattr(conductor, "_submit", fuse.around(conductor._submit))
    monkeypatch.setattr(conductor, "_cancel", fuse.around(conductor._cancel))
    return conductor


def conduct(
    laboratory: Laboratory, run_id: str, fuse: Fuse, monkeypatch: pytest.MonkeyPatch, cancel_at: int | None = None
) -> list[Job]:
    """Conduct to the end with a conductor that is killed once; jobs end as they come, the second on a fault.

    From look `cancel_at` on, the run is to be cancelled. The run's jobs, oldest first.
    """
    campaigns = laboratory.stores.campaigns
    for look in range(40):
        with monkeypatch.context() as patched:
            try:
                fragile(laboratory, fuse, patched).advance(run_id)
            except Killed:
                continue
        run = campaigns.run(run_id)
        made = [job for job in laboratory.jobs() if job.labels["campaign_run"] == run_id]
        if not run.open:
            return made
        if cancel_at is not None and look >= cancel_at and not run.cancel_requested:
            assert campaigns.save_run(replace(run, cancel_requested=True, revision=run.revision + 1), run.revision)
            continue
        queued = [job for job in made if job.state is JobState.QUEUED]
        assert len(queued) <= 1
        for job in queued:
            if made.index(job) == 1:
                laboratory.break_down(job)
            else:
                laboratory.end(job)
    raise AssertionError(campaigns.run(run_id))


def test_killed_at_every_touch(
    stores: Stores, database: Database, new_job: Callable[..., Job], monkeypatch: pytest.MonkeyPatch
) -> None:
    laboratory = Laboratory(stores, new_job)
    fuse = Fuse(0)
    for at in positions(database):
        run = new_run(campaign({}, {"retries": 1}))
        stores.campaigns.add_run(run)
        fuse = Fuse(at)
        made = conduct(laboratory, run.id, fuse, monkeypatch)
        ended = stores.campaigns.run(run.id)
        assert (ended.state, ended.verdict) == (JobState.SUCCEEDED, Verdict.PASS)
        assert len(made) == 3  # one a step, and the retry of the second
        assert [s.job_id for s in ended.steps] == [made[0].id, made[2].id]
        if not fuse.blown:
            break
    assert not fuse.blown
    assert at >= 12


@pytest.mark.parametrize("cancel_at", [0, 1])
def test_killed_at_every_touch_of_a_cancel(
    stores: Stores, database: Database, new_job: Callable[..., Job], cancel_at: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    laboratory = Laboratory(stores, new_job)
    fuse = Fuse(0)
    for at in positions(database):
        run = new_run(campaign({}, {"retries": 1}))
        stores.campaigns.add_run(run)
        fuse = Fuse(at)
        made = conduct(laboratory, run.id, fuse, monkeypatch, cancel_at)
        assert stores.campaigns.run(run.id).state is JobState.CANCELLED
        assert made[-1].state is JobState.CANCELLED
        assert all(job.state in (JobState.CANCELLED, JobState.SUCCEEDED) for job in made)
        if not fuse.blown:
            break
    assert not fuse.blown


def test_a_job_that_a_slower_process_submitted_for_nothing_is_taken_back(
    stores: Stores, new_job: Callable[..., Job], monkeypatch: pytest.MonkeyPatch
) -> None:
    slow, fast = Laboratory(stores, new_job), Laboratory(stores, new_job)
    run = new_run(campaign({}))
    stores.campaigns.add_run(run)
    submit = slow.submit

    def refuse(request: JobRequest, key: str, *, team: str) -> Job:
        raise BadParameter("dwell_s", -1, "not in this process's catalogue")

    def overtaken(request: JobRequest, key: str, *, team: str) -> Job:
        """The other process is refused, and ends the run, before this one's submit comes through."""
        fast.conductor().advance(run.id)
        return submit(request, key, team=team)

    monkeypatch.setattr(fast, "submit", refuse)
    monkeypatch.setattr(slow, "submit", overtaken)
    slow.conductor().advance(run.id)
    assert stores.campaigns.run(run.id).state is JobState.FAILED
    assert [job.state for job in slow.jobs()] == [JobState.CANCELLED]
