"""Ctrl-C while a command watches a job: what becomes of the job, and how to continue. SIGTERM and a closed terminal
(SIGHUP) do the same to a command that drives a bench itself.

A job of a service continues there. A job that the command's own process drives is asked to pause, so that no later
process takes it up by itself: the request stays with the job if this process ends before the bench comes to it.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from bench_service.cli.asking.client import call, segment
from bench_service.cli.asking.watching import ENDED
from bench_service.wall_clock import monotonic_s, pause

if TYPE_CHECKING:
    import httpx

PAUSE_S = 10.0
"""Longest time that a command waits for the pause [s]: a station may take hours."""
INTERRUPTED = 130
"""Exit code of a command that Ctrl-C ended, or one of the signals that do the same."""
LOOK_S = 0.1
"""Interval between two looks at the job [s]."""


def leave(client: "httpx.Client", job: dict[str, Any], server: str | None, say: Callable[[str], object]) -> None:
    """Leave a job in order, as after Ctrl-C, and print what happens to it. `server`: the service that drives it; None:
    this process.

    A job that this process drives is paused.
    """
    name = job["id"]
    if server is not None:
        at = f" --server {server}" if "://" in server else ""
        say(
            f"job {name} continues without this command: `bench job wait {name}{at}` waits for it, "
            f"`bench job cancel {name}{at}` ends it"
        )
        return
    say(f"job {name} is to pause before its next station; Ctrl-C again abandons the present station")
    try:
        job = _paused(client, name)
    except KeyboardInterrupt:
        job = {"state": "given up"}
    go_on = f"`bench job resume {name}` continues with the stations that remain, `bench job cancel {name}` ends it"
    if job["state"] == "paused":
        done = job["progress"]
        say(f"job {name} is paused after {done['station']} of {done['stations']} stations. {go_on}")
    elif job["state"] in ENDED:
        say(f"job {name} has ended: {job['state']}, verdict {job['verdict']}. `bench job show {name}` shows it")
    else:
        say(f"job {name} is left in its station, which will be repeated. It does not continue by itself: {go_on}")


def leave_campaign(
    client: "httpx.Client", run_id: str, server: str | None, again: str, say: Callable[[str], object]
) -> None:
    """Leave a campaign's run in order and print what happens to it; where this process drives it, its job is paused."""
    if server is not None:
        say(f"campaign run {run_id} continues in the service: {again}")
        return
    run = call(client, "GET", f"/api/v1/campaign-runs/{segment(run_id)}", ("state", "steps"))
    jobs = [step["job"] for step in run["steps"] if step["job"] and step["state"] in ("queued", "running", "paused")]
    if jobs:
        leave(client, {"id": jobs[-1]}, None, say)
        say(f"campaign run {run_id} waits for that job: once it continues, {again}")
    else:
        say(f"campaign run {run_id} is {run['state']}: {again}")


def _paused(client: "httpx.Client", job_id: str) -> dict[str, Any]:
    """Ask for the pause and wait for it, or for the job's end; return what the job is then."""
    path = f"/api/v1/jobs/{segment(job_id)}"
    found = call(client, "GET", path, ("state",))
    if found["state"] not in ENDED:
        found = call(client, "POST", f"{path}/pause", ("state",))
    due_s = monotonic_s() + PAUSE_S
    while found["state"] not in ("paused", *ENDED) and monotonic_s() < due_s:
        pause(LOOK_S)
        found = call(client, "GET", path, ("state",))
    return found
