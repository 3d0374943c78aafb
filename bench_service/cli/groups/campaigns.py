"""``bench campaign`` and ``bench schedule``: acceptance in one command, with an exit code that a CI system can read."""

import json
from functools import partial
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bench_service.cli.asking.client import answer, call, connect, segment
from bench_service.cli.asking.lists import everything, show
from bench_service.cli.asking.retries import with_retries
from bench_service.cli.asking.start_time import start_time
from bench_service.cli.files import clear_place, whole_file
from bench_service.cli.options import (
    NO_ITEMS,
    AsJson,
    Server,
    console,
    errors,
    key_or_new,
    labels,
    notice,
    parameter,
    wide,
)
from bench_service.cli.refusal import Refused

if TYPE_CHECKING:
    pass

campaigns = typer.Typer(no_args_is_help=True, help="Campaigns: procedures in order, with limits and a verdict.")
schedules = typer.Typer(no_args_is_help=True, help="Schedules: campaigns that start by themselves.")

Unit = Annotated[str, typer.Option(help="Serial of the unit")]
Bench = Annotated[str | None, typer.Option(help="Bench, where there are several")]


@campaigns.command("run")
def run_campaign(
    context: typer.Context,
    name: str,
    unit: Unit,
    bench: Bench = None,
    seed: Annotated[int | None, typer.Option(help="Base of the steps' seeds on a simulated bench")] = None,
    set_: Annotated[
        list[str], typer.Option("--set", help="A parameter, step.name=JSON value; may be repeated")
    ] = NO_ITEMS,
    label: Annotated[list[str], typer.Option(help="name=text; may be repeated")] = NO_ITEMS,
    key: Annotated[str | None, typer.Option(help="Idempotency key: repeated with it, the run continues")] = None,
    junit: Annotated[Path | None, typer.Option(dir_okay=False, help="Write JUnit XML to this file")] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Run a campaign on a unit and wait for its verdict. Exit code: 0 pass, 1 fail, 2 error."""
    from bench_service.cli.asking.leaving import INTERRUPTED, leave_campaign
    from bench_service.cli.asking.watching import CAMPAIGN_RUN, exit_code, watch_campaign
    from bench_service.cli.printing.campaign_tables import run_table

    if junit is not None:
        clear_place(junit)
    body = {"unit": unit, "bench": bench, "seed": seed, "labels": labels(label), "parameters": _step_parameters(set_)}
    key = key_or_new(key)
    with connect(context.obj, server, drive=True) as client:
        headers = {"Idempotency-Key": key}
        run = call(client, "POST", f"/api/v1/campaigns/{segment(name)}/runs", CAMPAIGN_RUN, json=body, headers=headers)
        again = f"the same command with --key {quote(key)} waits for it again"
        goes_on = f"The service has run {run['id']} and continues it: {again}"
        try:
            run = watch_campaign(client, run, errors, goes_on)
        except KeyboardInterrupt:
            leave_campaign(client, run["id"], server, again, notice)
            return INTERRUPTED
        path = f"/api/v1/campaign-runs/{run['id']}/report"
        report = with_retries(partial(call, client, "GET", path, ("run",)), notice, goes_on)
        if junit is not None:
            ask = partial(answer, client, "GET", path, params={"format": "junit"})
            _write_junit(with_retries(ask, notice, goes_on).content, run["id"], junit)
    if as_json:
        print(json.dumps(report, indent=2))
    else:
        wide().print(run_table(run))
        for warning in run["warnings"]:
            console.print(warning, style="yellow", soft_wrap=True)
        why = f": {run['reason']}" if run["reason"] else ""
        console.print(f"verdict {run['verdict']}, run {run['id']} {run['state']}{why}", soft_wrap=True)
    return exit_code(run["verdict"])


@campaigns.command("list")
def list_campaigns(context: typer.Context, server: Server = None, as_json: AsJson = False) -> None:
    """List the campaigns by name."""
    from bench_service.cli.printing.campaign_tables import campaign_table

    with connect(context.obj, server, drive=False) as client:
        items = everything(client, "/api/v1/campaigns")
    show(items, as_json, campaign_table)


@campaigns.command("show")
def show_campaign(context: typer.Context, name: str, server: Server = None) -> None:
    """A campaign as JSON, fit to be changed and added under another name."""
    with connect(context.obj, server, drive=False) as client:
        console.print_json(
            json.dumps(call(client, "GET", f"/api/v1/campaigns/{segment(name)}", ("campaign",))["campaign"])
        )


@campaigns.command("add")
def add_campaign(
    context: typer.Context,
    file: Annotated[
        Path, typer.Argument(exists=True, dir_okay=False, help="JSON file, as `bench campaign show` prints")
    ],
    server: Server = None,
) -> None:
    """Store a campaign; impossible steps are refused, doubtful ones give warnings."""
    with connect(context.obj, server, drive=False) as client:
        headers = {"Content-Type": "application/json"}
        made = call(
            client,
            "POST",
            "/api/v1/campaigns",
            ("name", "warnings", "duration_s"),
            content=file.read_bytes(),
            headers=headers,
        )
    for warning in made["warnings"]:
        console.print(warning, style="yellow", soft_wrap=True)
    console.print(f"campaign {made['name']}, {made['duration_s'] / 3600:.1f} h of bench time", soft_wrap=True)


@campaigns.command("runs")
def list_runs(
    context: typer.Context,
    campaign: Annotated[str | None, typer.Option(help="Only runs of this campaign")] = None,
    limit: Annotated[int, typer.Option(help="How many")] = 20,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Runs of campaigns, newest first."""
    from bench_service.cli.printing.campaign_tables import runs_table

    query = {"limit": limit} | ({} if campaign is None else {"campaign": campaign})
    with connect(context.obj, server, drive=False) as client:
        items = call(client, "GET", "/api/v1/campaign-runs", ("items",), params=query)["items"]
    show(items, as_json, runs_table)


@schedules.command("add")
def add_schedule(
    context: typer.Context,
    campaign: str,
    unit: Unit,
    cron: Annotated[str | None, typer.Option(help="minute hour day month weekday, such as '0 1 * * *'")] = None,
    time_zone: Annotated[str | None, typer.Option(help="Such as Europe/Kyiv; of --at else this host's")] = None,
    at: Annotated[str | None, typer.Option(help="Once, at this time: 22:30 or '2026-12-01 22:30'")] = None,
    bench: Bench = None,
    missed: Annotated[str, typer.Option(help="Missed starts: run_once or skip")] = "run_once",
    start_within_s: Annotated[float, typer.Option(help="Delay after which a start counts as missed [s]")] = 300.0,
    overlap: Annotated[str, typer.Option(help="Starts while the previous run is open: skip or queue")] = "skip",
    server: Server = None,
) -> None:
    """Add a schedule by which a campaign starts by itself: repeatedly (--cron), or once (--at)."""
    body = {
        **_times(cron, time_zone, at),
        "campaign": campaign,
        "unit": unit,
        "bench": bench,
        "missed": missed,
        "start_within_s": start_within_s,
        "overlap": overlap,
    }
    with connect(context.obj, server, drive=False) as client:
        made = call(client, "POST", "/api/v1/schedules", ("id", "next_at"), json=body)
    console.print(f"schedule {made['id']}, next start {made['next_at']}", soft_wrap=True)


def _times(cron: str | None, time_zone: str | None, at: str | None) -> dict[str, Any]:
    """Times of a schedule by its options. Raises `Refused` where they are not one of the two kinds."""
    if at is not None and cron is None:
        return {"at": start_time(at, time_zone).isoformat()}
    if cron is None or time_zone is None or at is not None:
        raise Refused("give --cron with --time-zone for repeated starts, or --at for one")
    return {"cron": cron, "time_zone": time_zone}


@schedules.command("list")
def list_schedules(context: typer.Context, server: Server = None, as_json: AsJson = False) -> None:
    """List the schedules, newest first."""
    from bench_service.cli.printing.campaign_tables import schedule_table

    with connect(context.obj, server, drive=False) as client:
        items = everything(client, "/api/v1/schedules")
    show(items, as_json, schedule_table)


@schedules.command("remove")
def remove_schedule(context: typer.Context, schedule: str, server: Server = None) -> None:
    """Delete a schedule; its runs are kept."""
    with connect(context.obj, server, drive=False) as client:
        answer(client, "DELETE", f"/api/v1/schedules/{segment(schedule)}")


def _write_junit(content: bytes, run_id: str, file: Path) -> None:
    try:
        with whole_file(file) as sink:
            sink.write(content)
    except Refused as error:
        raise Refused(f"{error}; the run is {run_id}") from error


def _step_parameters(texts: list[str]) -> dict[str, dict[str, Any]]:
    """Convert ``step.name=value`` texts to step -> name -> value."""
    found: dict[str, dict[str, Any]] = {}
    for text in texts:
        path, value = parameter(text)
        step, dot, name = path.partition(".")
        if not (step and dot and name):
            raise Refused(f"--set {text}: expected step.name=value")
        found.setdefault(step, {})[name] = value
    return found
