"""``bench job``: one job is shown, waited for, paused, resumed, answered or cancelled."""

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bench_service.cli.asking.client import answer, call, connect, segment
from bench_service.cli.groups.jobs import follow
from bench_service.cli.options import AsJson, By, Server, console, named, of_bench
from bench_service.cli.printing.job_view import job_view, state_of
from bench_service.cli.refusal import Refused

if TYPE_CHECKING:
    import httpx

job = typer.Typer(no_args_is_help=True, help="One job: show, wait, cancel, pause, resume, answer, priority.")
Job = Annotated[str, typer.Argument(help="Id of the job")]


@job.command("show")
def show_job(context: typer.Context, job_id: Job, server: Server = None, as_json: AsJson = False) -> None:
    """Show a job: state, place in the queue, why it waits, what it asks, how it ended."""
    with connect(context.obj, server, drive=False) as client:
        found = _read(client, job_id)
    if as_json:
        print(json.dumps(found, indent=2))
    else:
        console.print(job_view(found))


@job.command("wait")
def wait_for_job(context: typer.Context, job_id: Job, server: Server = None, as_json: AsJson = False) -> int:
    """Wait for a job that a service or worker drives. Exit code: 0 pass, 1 fail, 2 error."""
    with connect(context.obj, server, drive=False) as client:
        address = server or "another process"
        return follow(client, _read(client, job_id), address, as_json)


@job.command("cancel")
def cancel_job(context: typer.Context, job_id: Job, by: By = None, server: Server = None) -> None:
    """Cancel a job: a queued one at once, a running one as soon as its bench is safe. Its recordings are kept."""
    _ask(context, job_id, "cancel", by, server)


@job.command("pause")
def pause_job(context: typer.Context, job_id: Job, by: By = None, server: Server = None) -> None:
    """Pause a job: a queued one at once, a running one before its next station."""
    _ask(context, job_id, "pause", by, server)


@job.command("resume")
def resume_job(
    context: typer.Context,
    job_id: Job,
    by: By = None,
    no_wait: Annotated[bool, typer.Option("--no-wait", help="Queue it and end; a service or worker runs it")] = False,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Go on with a paused or interrupted job: it does the stations that remain. Waits for its verdict."""
    if no_wait:
        _ask(context, job_id, "resume", by, server)
        return 0
    settings = context.obj
    if server is None:
        with connect(settings, None, drive=False) as client:
            settings = of_bench(settings, _read(client, job_id)["bench"])
    with connect(settings, server, drive=True) as client:
        resumed = _post(client, job_id, "resume", by)
        return follow(client, resumed, server, as_json)


@job.command("answer")
def answer_job(
    context: typer.Context,
    job_id: Job,
    done: Annotated[
        bool, typer.Option("--done/--declined", help="Whether the task of the prompt is done, or will not be done")
    ],
    remark: Annotated[str, typer.Option(help="Remark on it")] = "",
    prompt: Annotated[str | None, typer.Option(help="Id of the prompt; default: the open one")] = None,
    by: By = None,
    server: Server = None,
) -> None:
    """Answer what a job asks of the person at the bench; a job that is declined ends cancelled."""
    with connect(context.obj, server, drive=False) as client:
        asked = prompt or (_read(client, job_id).get("prompt") or {}).get("id", "none")
        _say(_post(client, job_id, "answer", by, {"prompt": asked, "done": done, "remark": remark}))


@job.command("priority")
def set_priority(
    context: typer.Context,
    job_id: Job,
    priority: Annotated[int, typer.Argument(min=1, max=1000, help="Smaller runs first")],
    server: Server = None,
) -> None:
    """Change the priority of a queued job, and with it its place in the queue."""
    with connect(context.obj, server, drive=False) as client:
        _say(call(client, "PATCH", f"/api/v1/jobs/{segment(job_id)}", ("id", "state"), json={"priority": priority}))


def _ask(
    context: typer.Context,
    job_id: str,
    what: str,
    by: str | None,
    server: str | None,
    body: dict[str, Any] | None = None,
) -> None:
    with connect(context.obj, server, drive=False) as client:
        _say(_post(client, job_id, what, by, body))


def _post(
    client: "httpx.Client", job_id: str, what: str, by: str | None, body: dict[str, Any] | None = None
) -> dict[str, Any]:
    return call(client, "POST", f"/api/v1/jobs/{segment(job_id)}/{what}", ("id", "state"), json=body, headers=named(by))


def _read(client: "httpx.Client", job_id: str) -> dict[str, Any]:
    found = answer(client, "GET", f"/api/v1/jobs/{segment(job_id)}").json()
    if not isinstance(found, dict) or "state" not in found:
        raise Refused(f"{client.base_url} is not a bench service: its answer is not a job")
    return found


def _say(found: dict[str, Any]) -> None:
    waits = f": {found['waiting']}" if found.get("waiting") else ""
    console.print(f"job {found['id']} is {state_of(found)}{waits}", soft_wrap=True)
