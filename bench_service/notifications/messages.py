"""Messages as values, and how events of jobs, stops and campaigns become messages."""

from dataclasses import dataclass
from datetime import datetime

from bench_service.campaigns.run import CampaignRun
from bench_service.model.job import Event, Job
from bench_service.model.records import BenchStop
from bench_service.notifications.targets import EventKind
from procedures.core.limits import Check, Verdict


@dataclass(frozen=True)
class Message:
    """One message to people. `key` names what it is about: the same thing is sent once."""

    key: str
    kind: EventKind
    title: str
    text: str
    bench: str
    at: datetime
    page: str
    """Path of the page that shows it."""


def of_event(job: Job, event: Event) -> Message | None:
    """Message about an event of a job: its verdict, its trouble, or a prompt; None for any other."""
    about = f"{job.procedure} on {job.unit}"
    key, page = f"{job.id}-{event.sequence}", f"/jobs/{job.id}"
    if event.kind == "prompt":
        text = str(event.data.get("text", ""))
        return Message(key, "prompt", f"{job.bench}: to be done at the bench", text, job.bench, event.at, page)
    if event.kind != "state":
        return None
    verdict, failure = event.data.get("verdict"), event.data.get("failure")
    if verdict in (Verdict.PASS.value, Verdict.FAIL.value):
        title = f"{job.bench}: {verdict.upper()} {about}"
        return Message(key, "verdict", title, f"{about}: {verdict}.", job.bench, event.at, page)
    if failure:
        text = f"{about} did not end well: {failure.get('kind')}: {failure.get('message')}"
        return Message(key, "trouble", f"{job.bench}: {failure.get('kind')}, {about}", text, job.bench, event.at, page)
    return None


def of_stop(stop: BenchStop) -> Message:
    """Make the message about a stop that stands, for the people that targets name."""
    text = f"Stopped by {stop.by or 'somebody'}: {stop.reason}. Jobs wait until a person releases it."
    return Message(
        f"stop-{stop.id}", "stop", f"{stop.bench}: STOPPED", text, stop.bench, stop.at, f"/#bench-{stop.bench}"
    )


def _value_of(check: Check) -> str:
    return "unbounded" if check.value is None else f"= {check.value:.6g} {check.limit.unit}"


def of_run(run: CampaignRun, at: datetime) -> Message | None:
    """Make the message about a campaign run that ended otherwise than with a pass; None for a run that passed or goes
    on.
    """
    if run.open or run.verdict is Verdict.PASS:
        return None
    outcome = run.state.value if run.verdict is None else run.verdict.value
    missed = [
        f"{step.name}: {check.name} {_value_of(check)}{' (inconclusive)' * check.inconclusive}"
        for step in run.steps
        for check in step.checks
        if not check.passed
    ]
    text = "\n".join([run.reason or f"The campaign ended: {outcome}.", *missed[:20]])
    title = f"{run.bench}: {outcome.upper()} campaign {run.campaign.name} on {run.unit}"
    return Message(
        f"run-{run.id}", "campaign", title, text, run.bench, run.finished_at or at, f"/campaign-runs/{run.id}"
    )


def of_disk(bench: str, free: int, at: datetime) -> Message:
    """Make the message about a disk that is nearly full; its key has the date, so there is one a day."""
    text = f"{free / 1e6:.0f} MB are free on the disk of the database: recordings will soon be refused."
    return Message(f"disk-{at.date().isoformat()}", "disk", f"{bench}: the disk is nearly full", text, bench, at, "/")


def digest(messages: list[Message], bench: str, at: datetime) -> Message:
    """Make one message from those above the hourly limit, with the title and time of each."""
    lines = [f"{one.at.isoformat(timespec='seconds')}  {one.title}" for one in messages]
    title = f"{bench}: {len(messages)} messages in one, because the hourly limit was reached"
    return Message(f"digest-{messages[0].key}", messages[0].kind, title, "\n".join(lines), bench, at, "/")
