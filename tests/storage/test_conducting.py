"""Campaign runs on both databases: order, stop rules, retries, limits, trends; and what is left of a kill anywhere."""

from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from threading import Thread
from typing import Any

import pytest

from bench_service.campaigns.run import CampaignRun, StepState
from bench_service.campaigns.stores import Stores
from bench_service.model.errors import NotDriving
from bench_service.model.job import Job, JobState
from bench_service.model.records import BenchStop
from bench_service.model.request import JobRequest
from bench_service.wall_clock import now
from procedures.core.limits import Verdict
from tests.stops import release_all
from tests.storage.campaigns import NOW, Laboratory, campaign, new_run, value_check

PASS, FAIL = Verdict.PASS, Verdict.FAIL


@pytest.fixture
def laboratory(stores: Stores, new_job: Callable[..., Job]) -> Laboratory:
    return Laboratory(stores, new_job)


def states(run: CampaignRun) -> list[str]:
    return [step.state.value for step in run.steps]


def test_steps_in_order_and_their_seeds(laboratory: Laboratory) -> None:
    run = laboratory.done(new_run(campaign({}, {}, {}), labels={"night": "1"}), PASS, PASS, PASS)
    assert (run.state, run.verdict, states(run)) == (JobState.SUCCEEDED, PASS, ["succeeded"] * 3)
    assert [request.seed for request in laboratory.requests] == [100, 101, 102]
    assert [job.id for job in laboratory.jobs()] == [step.job_id for step in run.steps]
    labels = laboratory.jobs()[1].labels
    assert labels == {"night": "1", "campaign": "trial", "campaign_run": run.id, "step": "b"}


@pytest.mark.parametrize(
    ("steps", "more", "endings", "verdict", "found"),
    [
        (({}, {}), {}, (FAIL, PASS), FAIL, ["succeeded", "succeeded"]),
        (({"on_fail": "stop"}, {}), {}, (FAIL,), FAIL, ["succeeded", "skipped"]),
        (({}, {}), {}, ("DeviceFault",), Verdict.ERROR, ["failed", "skipped"]),
        (({"on_error": "continue"}, {}), {}, ("DeviceFault", PASS), Verdict.ERROR, ["failed", "succeeded"]),
        (({"retries": 1}, {}), {}, ("DeviceFault", PASS, PASS), PASS, ["succeeded", "succeeded"]),
        (({"retries": 1}, {}), {}, ("DeviceFault", "DeviceFault"), Verdict.ERROR, ["failed", "skipped"]),
        (({"retries": 3}, {}), {}, ("BadParameter",), Verdict.ERROR, ["failed", "skipped"]),
        (
            ({"on_error": "continue"},) * 3,
            {"max_errors": 2},
            ("DeviceFault", "DeviceFault"),
            Verdict.ERROR,
            ["failed", "failed", "skipped"],
        ),
    ],
)
def test_stop_rules(
    laboratory: Laboratory, steps: Any, more: Any, endings: Any, verdict: Verdict, found: list[str]
) -> None:
    run = laboratory.done(new_run(campaign(*steps, **more)), *endings)
    assert (run.verdict, states(run)) == (verdict, found)
    assert run.state is (JobState.FAILED if verdict is Verdict.ERROR else JobState.SUCCEEDED)
    assert all(step.reason for step in run.steps if step.state in (StepState.SKIPPED, StepState.FAILED))


def test_a_retry_is_another_job_with_another_seed(laboratory: Laboratory) -> None:
    run = laboratory.done(new_run(campaign({"retries": 2})), "DeviceFault", "DeviceFault", PASS)
    jobs = laboratory.jobs()
    assert [job.seed for job in jobs] == [100, 1100, 2100]
    assert run.steps[0].earlier_jobs == (jobs[0].id, jobs[1].id)
    assert (run.steps[0].job_id, run.steps[0].attempt) == (jobs[2].id, 3)


@pytest.mark.parametrize("stopped", [False, True])
def test_a_job_that_a_person_cancels_is_not_tried_again_one_of_a_stopped_bench_is(
    laboratory: Laboratory, stopped: bool
) -> None:
    run = laboratory.done(new_run(campaign({"retries": 3})))
    (job,) = laboratory.jobs()
    laboratory.stores.jobs.transition(job.id, JobState.RUNNING, at=NOW)
    if stopped:
        laboratory.stores.benches.stop_bench(BenchStop("sim", NOW, "smoke"))
    laboratory.stores.jobs.request_cancel(job.id, NOW)
    laboratory.stores.jobs.transition(job.id, JobState.CANCELLED, at=NOW)
    laboratory.conductor().advance(run.id)
    run = laboratory.stores.campaigns.run(run.id)
    if not stopped:
        assert (run.state, run.verdict, states(run)) == (JobState.FAILED, Verdict.ERROR, ["cancelled"])
        assert run.steps[0].reason == f"job {job.id} was cancelled"
    else:
        assert (run.state, states(run), len(laboratory.jobs())) == (JobState.RUNNING, ["queued"], 1)
        release_all(laboratory.stores.benches, "sim")
        laboratory.conductor().advance(run.id)
        assert [j.state for j in laboratory.jobs()] == [JobState.CANCELLED, JobState.QUEUED]


def test_the_log_tells_what_became_of_steps_and_run(laboratory: Laboratory, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", logger="bench_service.campaigns.run_log")
    run = laboratory.done(new_run(campaign({"retries": 1}, {})), "DeviceFault", PASS, FAIL)
    said = [r.getMessage() for r in caplog.records if r.name == "bench_service.campaigns.run_log"]
    assert said[0] == f"campaign run {run.id} of trial on U-1 is running"
    assert "step a, attempt 1" in said
    assert any(line.startswith("step a is queued: attempt 1:") and "the table said so" in line for line in said)
    assert said[-2:] == [
        "step b is succeeded, verdict fail",
        f"campaign run {run.id} of trial on U-1 is succeeded, verdict fail",
    ]


def test_a_limit_of_the_campaign_in_its_own_unit(laboratory: Laboratory) -> None:
    limits = [{"quantity": "bias", "unit": "rad/s", "maximum": 1e-6}]
    for value, verdict in ((0.2, PASS), (0.21, FAIL)):  # 1e-6 rad/s is 0.20626 deg/h
        run = new_run(campaign({"limits": limits}))
        laboratory.stores.campaigns.add_run(run)
        conductor = laboratory.conductor()
        conductor.advance(run.id)
        laboratory.end(laboratory.jobs()[-1], checks=[value_check("bias", value)])
        conductor.advance(run.id)
        run = laboratory.stores.campaigns.run(run.id)
        assert run.verdict is verdict
        own, added = run.steps[0].checks
        assert (own.name, own.passed) == ("bias", True)
        assert added.value == pytest.approx(value * 4.84813681109536e-06)
        assert added.passed is (verdict is PASS)


@pytest.mark.parametrize(
    ("quantity", "unit", "said"), [("drift", "deg/h", "the result has bias"), ("bias", "ppm", "ppm cannot")]
)
def test_a_limit_that_the_result_cannot_answer_is_an_error(
    laboratory: Laboratory, quantity: str, unit: str, said: str
) -> None:
    run = new_run(campaign({"limits": [{"quantity": quantity, "unit": unit, "maximum": 1.0}]}))
    laboratory.stores.campaigns.add_run(run)
    conductor = laboratory.conductor()
    conductor.advance(run.id)
    laboratory.end(laboratory.jobs()[-1], checks=[value_check("bias", 0.1)])
    conductor.advance(run.id)
    run = laboratory.stores.campaigns.run(run.id)
    assert (run.state, run.verdict) == (JobState.FAILED, Verdict.ERROR)
    assert said in run.steps[0].reason


@pytest.mark.parametrize("outcome", ["warning", "fail"])
def test_a_value_out_of_the_units_history(laboratory: Laboratory, outcome: str) -> None:
    of = campaign({"trends": [{"quantity": "bias", "at_least": 4, "outcome": outcome}]})
    said: list[tuple[Verdict | None, int]] = []
    for value in (1.0, 1.1, 0.9, 1.0, 1.05, 3.0):
        run = new_run(of)
        laboratory.stores.campaigns.add_run(run)
        conductor = laboratory.conductor()
        conductor.advance(run.id)
        laboratory.end(laboratory.jobs()[-1], checks=[value_check("bias", value)])
        conductor.advance(run.id)
        run = laboratory.stores.campaigns.run(run.id)
        said.append((run.verdict, sum("trend" in w for w in run.steps[0].warnings)))
    too_few, inside = [(PASS, 1)] * 4, [(PASS, 0)]
    assert said == [*too_few, *inside, (PASS, 1) if outcome == "warning" else (FAIL, 0)]


def test_a_stopped_bench_is_waited_for_and_said(laboratory: Laboratory) -> None:
    benches, campaigns = laboratory.stores.benches, laboratory.stores.campaigns
    benches.stop_bench(BenchStop("sim", NOW, "smoke"))
    run = laboratory.done(new_run(campaign({})))
    assert (run.state, laboratory.jobs()) == (JobState.RUNNING, [])
    assert "smoke" in run.waiting
    revision = run.revision
    laboratory.conductor().advance(run.id)
    assert campaigns.run(run.id).revision == revision  # it does not say so again and again
    release_all(benches, "sim")
    laboratory.conductor().advance(run.id)
    assert (len(laboratory.jobs()), campaigns.run(run.id).waiting) == (1, "")


def test_a_paused_job_pauses_the_run(laboratory: Laboratory) -> None:
    run = laboratory.done(new_run(campaign({})))
    job = laboratory.jobs()[0]
    laboratory.stores.jobs.request_pause(job.id, NOW)
    laboratory.conductor().advance(run.id)
    run = laboratory.stores.campaigns.run(run.id)
    assert (run.state, states(run)) == (JobState.PAUSED, ["paused"])
    assert job.id in run.waiting
    laboratory.stores.jobs.resume(job.id, NOW)
    laboratory.conductor().advance(run.id)
    assert laboratory.stores.campaigns.run(run.id).state is JobState.RUNNING


def test_the_window_closes(laboratory: Laboratory) -> None:
    campaigns = laboratory.stores.campaigns
    run = laboratory.done(new_run(campaign({}, {}, window_h=1.0)))
    assert campaigns.save_run(replace(run, started_at=now() - timedelta(hours=2)), run.revision)
    laboratory.conductor().advance(run.id)
    run = campaigns.run(run.id)
    assert laboratory.jobs()[0].state is JobState.CANCELLED
    assert (run.state, run.verdict, states(run)) == (JobState.FAILED, Verdict.ERROR, ["cancelled", "skipped"])
    assert "window of 1 h" in run.reason


def test_runs_of_one_bench_are_done_one_after_another(laboratory: Laboratory) -> None:
    campaigns, conductor = laboratory.stores.campaigns, laboratory.conductor()
    first, second, other = new_run(campaign({})), new_run(campaign({})), new_run(campaign({}), bench="sim2")
    for run in (second, first, other):
        campaigns.add_run(run)
    for _ in range(3):
        conductor.look()
    assert {job.labels["campaign_run"] for job in laboratory.jobs()} == {first.id, other.id}
    assert first.id in campaigns.run(second.id).waiting
    for job in laboratory.jobs():
        laboratory.end(job)
    conductor.look()
    conductor.look()
    assert laboratory.jobs()[-1].labels["campaign_run"] == second.id


def test_a_process_that_cannot_submit_waits(laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(request: JobRequest, key: str, *, team: str) -> Job:
        raise NotDriving("nobody drives")

    with monkeypatch.context() as patched:
        patched.setattr(laboratory, "submit", refuse)
        run = laboratory.done(new_run(campaign({})))
        assert (run.waiting, states(run)) == ("nobody drives", ["queued"])
    laboratory.conductor().advance(run.id)
    assert len(laboratory.jobs()) == 1


def test_many_conductors_submit_each_step_once(laboratory: Laboratory) -> None:
    run = new_run(campaign({}, {}, {}))
    laboratory.stores.campaigns.add_run(run)
    for step in range(3):
        threads = [Thread(target=laboratory.conductor().advance, args=(run.id,)) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(laboratory.jobs()) == step + 1
        laboratory.end(laboratory.jobs()[-1])
    laboratory.conductor().advance(run.id)
    assert laboratory.stores.campaigns.run(run.id).verdict is PASS
