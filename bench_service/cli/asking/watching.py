"""Progress of a job, a campaign's run or a batch of analyses until its end, with a progress bar for a person."""

from functools import partial
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from bench_service.cli.asking.client import call
from bench_service.cli.asking.retries import with_retries
from bench_service.cli.options import notice
from bench_service.wall_clock import monotonic_s, pause

if TYPE_CHECKING:
    import httpx

ENDED = ("succeeded", "failed", "cancelled", "interrupted")
LOOK_S = 0.1
"""Interval between two polls of the service [s]."""
LOOK_TIMEOUT_S = 15.0
"""Longest time that one poll may take [s]: a service that hangs counts as away."""
JOB = ("id", "procedure", "unit", "state", "verdict", "progress", "page", "result", "error")
CAMPAIGN_RUN = ("id", "campaign", "unit", "state", "verdict", "steps", "waiting", "reason", "warnings")
"""Fields of a job and of a campaign's run that commands read."""
NEXT = "it is next"
"""What a service says of a queued job that nothing holds: no reason to wait."""
STANDS_S = 1.0
"""Time for which a reason must stand before it is printed [s]: most are over with the next poll."""
UNENDED = ("waiting", "running")
"""States of a batch's tasks that have not ended."""


class _Reasons:
    """Reasons why a job or run waits, each printed once when it has stood for a moment, also where there is no bar."""

    def __init__(self, what: str) -> None:
        self._what, self._reason, self._since_s, self._said = what, "", 0.0, ""

    def look(self, reason: str | None) -> None:
        """Take the present reason, empty or None where nothing waits, and print it where it is time to."""
        now = "" if reason == NEXT else reason or ""
        if now != self._reason:
            self._reason, self._since_s = now, monotonic_s()
        if not now:
            self._said = ""
        elif now != self._said and monotonic_s() - self._since_s >= STANDS_S:
            self._said = now
            notice(f"{self._what} waits: {now}")


def watch(client: "httpx.Client", job: dict[str, Any], console: Console) -> dict[str, Any]:
    """Follow a job with a progress bar until it has ended, and return its last state. Raises `Refused` where the
    service is away for long.
    """
    page = f"{str(client.base_url).rstrip('/')}{job['page']}"
    goes_on = f"The service has job {job['id']} and continues it: {page} shows it, `bench jobs` lists it"
    with _progress(console) as progress:
        bar = progress.add_task(f"{job['procedure']} {job['unit']}", total=job["progress"]["stations"] or 1, doing="")
        paused, reasons = False, _Reasons(f"job {job['id']}")
        while job["state"] not in ENDED:
            if (job["state"] == "paused") > paused:
                notice(f"job {job['id']} is paused: `bench job resume {job['id']}` continues it")
            paused = job["state"] == "paused"
            job = _looked_at(client, f"/api/v1/jobs/{job['id']}", JOB, goes_on)
            reasons.look(None if job["state"] in ("paused", *ENDED) else job.get("waiting"))
            progress.update(bar, completed=job["progress"]["station"])
        if job["state"] == "succeeded":
            progress.update(bar, completed=job["progress"]["stations"] or 1)
    return job


def exit_code(verdict: str | None) -> int:
    """Return the exit code of a verdict: 0 pass, 1 fail, 2 everything else."""
    return {"pass": 0, "fail": 1}.get(verdict or "", 2)


def watch_campaign(client: "httpx.Client", run: dict[str, Any], console: Console, goes_on: str) -> dict[str, Any]:
    """Follow a campaign's run until it has ended; the reason that it waits for is shown next to the bar.

    Raises `Refused` with `goes_on` where the service is away for long.
    """
    with _progress(console) as progress:
        bar = progress.add_task(f"{run['campaign']} {run['unit']}", total=len(run["steps"]), doing="")
        reasons = _Reasons(f"run {run['id']}")
        while True:
            ended = [step for step in run["steps"] if step["finished_at"] or step["state"] == "skipped"]
            now = next((s["name"] for s in run["steps"] if s["state"] in ("running", "paused")), "")
            progress.update(bar, completed=len(ended), doing=run["waiting"] or now)
            if run["state"] in ENDED:
                return run
            reasons.look(run["waiting"])
            run = _looked_at(client, f"/api/v1/campaign-runs/{run['id']}", CAMPAIGN_RUN, goes_on)


def watch_batch(
    client: "httpx.Client", batch: dict[str, Any], path: str, fields: tuple[str, ...], console: Console
) -> dict[str, Any]:
    """Follow a batch of analyses, at `path`, until all have ended; return the `fields` of its last state.

    Raises `Refused` where the service is away for long.
    """
    goes_on = f"The service has batch {batch['id']} and continues it: `bench batch watch {batch['id']}` shows it"
    with _progress(console) as progress:
        bar = progress.add_task(f"batch {batch['id']}", total=batch["total"], doing="")
        while True:
            counts = batch["counts"]
            progress.update(bar, completed=batch["total"] - sum(counts[state] for state in UNENDED))
            if batch["ended_at"] is not None:
                return batch
            batch = _looked_at(client, path, fields, goes_on)


def _looked_at(client: "httpx.Client", path: str, fields: tuple[str, ...], goes_on: str) -> dict[str, Any]:
    """State of what is followed after the next interval. Raises `Refused` where the service is away for long."""
    pause(LOOK_S)
    return with_retries(partial(call, client, "GET", path, fields, timeout=LOOK_TIMEOUT_S), notice, goes_on)


def _progress(console: Console) -> Progress:
    """Build the progress bar; names and reasons come from people and are no markup."""
    name, doing = (TextColumn(text, markup=False) for text in ("{task.description}", "{task.fields[doing]}"))
    return Progress(name, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), doing, console=console)
