"""``bench run`` and the list of jobs: submit a procedure, watch it to its verdict, leave it in order."""

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bench_service.cli.asking.client import RESULT, call, connect
from bench_service.cli.asking.lists import newest
from bench_service.cli.asking.start_time import start_time
from bench_service.cli.completion import procedure_names
from bench_service.cli.options import (
    NO_ITEMS,
    AsJson,
    By,
    Key,
    Label,
    Limit,
    Server,
    Set,
    console,
    errors,
    key_or_new,
    labels,
    named,
    notice,
    of_bench,
    parameter,
    wide,
)
from bench_service.cli.refusal import Refused

if TYPE_CHECKING:
    import httpx


def run(
    context: typer.Context,
    procedure: Annotated[str, typer.Argument(autocompletion=procedure_names)],
    unit: Annotated[str, typer.Option(help="Serial of the unit")],
    set_: Set = NO_ITEMS,
    seed: Annotated[int | None, typer.Option(help="Seed of a simulated bench")] = None,
    bench: Annotated[str | None, typer.Option(help="Bench, where there are several")] = None,
    priority: Annotated[int, typer.Option(min=1, max=1000, help="Smaller runs first")] = 10,
    label: Label = NO_ITEMS,
    retries: Annotated[int, typer.Option(min=0, max=5, help="After faults of the bench")] = 0,
    reservation: Annotated[str | None, typer.Option(help="The reservation under which it runs")] = None,
    mounting: Annotated[str | None, typer.Option(help="The unit's mounting; default: the one in place")] = None,
    at: Annotated[str | None, typer.Option(help="Not before this time: 22:30 or '2026-12-01 22:30'")] = None,
    key: Key = None,
    by: By = None,
    no_wait: Annotated[bool, typer.Option("--no-wait", help="Queue it and end; a service or worker runs it")] = False,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Run a procedure on a unit and wait for its verdict. Ctrl-C pauses the job, or leaves it to the service."""
    from bench_service.cli.asking.watching import JOB

    body = {
        "procedure": procedure,
        "unit": unit,
        "parameters": dict(map(parameter, set_)),
        "seed": seed,
        "bench": bench,
        "priority": priority,
        "labels": labels(label),
        "retries": retries,
        "reservation": reservation,
        "mounting": mounting,
        **({} if at is None else {"not_before": start_time(at).isoformat()}),
    }
    headers = {"Idempotency-Key": key_or_new(key), **named(by)}
    settings = of_bench(context.obj, bench) if server is None else context.obj
    with connect(settings, server, drive=not no_wait) as client:
        job = call(client, "POST", "/api/v1/jobs", JOB, json=body, headers=headers)
        if no_wait:
            _queued(job, server, as_json)
            return 0
        return follow(client, job, server, as_json)


def _queued(job: dict[str, Any], server: str | None, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"job": job, "result": None}, indent=2))
        return
    console.print(f"job {job['id']} is {job['state']}", soft_wrap=True)
    if server is None:
        notice("a service or worker that drives its bench runs it: `bench serve`, or `bench worker`")


def follow(client: "httpx.Client", job: dict[str, Any], server: str | None, as_json: bool) -> int:
    """Watch a job to its end, print its result, and return the exit code of its verdict.

    Ctrl-C: a job of a service continues there; one that this process drives is paused.
    """
    from bench_service.cli.asking.leaving import INTERRUPTED, leave
    from bench_service.cli.asking.watching import watch

    try:
        job = watch(client, job, errors)
    except KeyboardInterrupt:
        leave(client, job, server, notice)
        return INTERRUPTED
    result = call(client, "GET", f"/api/v1/jobs/{job['id']}/result", RESULT) if job["result"] else None
    return _print_end(job, result, as_json)


def _print_end(job: dict[str, Any], result: dict[str, Any] | None, as_json: bool) -> int:
    from bench_service.cli.asking.watching import exit_code
    from bench_service.cli.printing.check_tables import check_table, show_warnings

    if as_json:
        print(json.dumps({"job": job, "result": result}, indent=2))
    elif result is None:
        raise Refused(f"job {job['id']} {job['state']}: {(job['error'] or {}).get('message', 'no reason given')}")
    else:
        console.print(check_table(result["document"]))
        show_warnings(result["document"], console)
        console.print(f"verdict {job['verdict']}, job {job['id']}", soft_wrap=True)
    return exit_code(job["verdict"])


def jobs(
    context: typer.Context,
    state: Annotated[str | None, typer.Option(help="Only jobs in this state")] = None,
    procedure: Annotated[str | None, typer.Option(help="Only jobs of this procedure")] = None,
    unit: Annotated[str | None, typer.Option(help="Only jobs of this unit")] = None,
    bench: Annotated[str | None, typer.Option(help="Only jobs of this bench")] = None,
    verdict: Annotated[str | None, typer.Option(help="pass, fail or error")] = None,
    since: Annotated[
        str | None, typer.Option(help="Created at this time, date or later, or so long ago: 2026-11-30, 7d")
    ] = None,
    until: Annotated[str | None, typer.Option(help="Created before; as --since")] = None,
    label: Annotated[list[str], typer.Option(help="name or name=text; may be repeated")] = NO_ITEMS,
    text: Annotated[str | None, typer.Option(help="In an id, a name or a label")] = None,
    limit: Limit = 20,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List jobs, newest first."""
    from bench_service.cli.printing.tables import job_table

    query: dict[str, Any] = {"state": state, "procedure": procedure, "unit": unit, "bench": bench, "verdict": verdict}
    query |= {"since": since, "until": until, "label": label, "text": text}
    with connect(context.obj, server, drive=False) as client:
        page = newest(client, "/api/v1/jobs", limit, query)
    if as_json:
        print(json.dumps(page, indent=2))
    else:
        wide().print(job_table(page["items"]))
