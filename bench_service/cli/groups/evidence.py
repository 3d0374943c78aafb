"""Commands about evidence: recordings and results are listed, methods run."""

import json
from typing import Annotated, Any

import typer

from bench_service.cli.asking.client import RESULT, call, connect, segment
from bench_service.cli.asking.lists import newest, show
from bench_service.cli.completion import method_names
from bench_service.cli.groups.batches import selection_of, submit
from bench_service.cli.options import NO_ITEMS, AsJson, Limit, Server, Set, console, parameter

Labelled = Annotated[list[str], typer.Option("--label", help="Only of jobs with name or name=text; may be repeated")]
Verdict = Annotated[str | None, typer.Option(help="pass, fail or error")]
Since = Annotated[str | None, typer.Option(help="Created at this time, date or later, or so long ago: 2026-11-30, 7d")]
Until = Annotated[str | None, typer.Option(help="Created before; as --since")]
Text = Annotated[str | None, typer.Option(help="In an id, a name, a label or the name of an imported file")]


def analyse(
    context: typer.Context,
    method: Annotated[str, typer.Argument(autocompletion=method_names)],
    recording: Annotated[list[str], typer.Option(help="Id of a recording; may be repeated")] = NO_ITEMS,
    calibration: Annotated[list[str], typer.Option(help="Id of a calibration; may be repeated")] = NO_ITEMS,
    unit: Annotated[str | None, typer.Option(help="Serial of the unit, for a method that needs no evidence")] = None,
    set_: Set = NO_ITEMS,
    where: Annotated[
        list[str],
        typer.Option(
            help="A batch over recordings that meet it: unit, procedure, job, verdict, since, until, text, simulated, "
            "label or id = value; may be repeated"
        ),
    ] = NO_ITEMS,
    each: Annotated[str, typer.Option(help="With --where, analysed together: recording, job or unit")] = "recording",
    priority: Annotated[int, typer.Option(min=0, max=100, help="With --where: among batches, smaller first")] = 10,
    wait: Annotated[bool, typer.Option(help="With --where: watch the batch until its end")] = True,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Run a method on stored recordings or calibrations; prints its coefficients, checks and verdict.

    With --where: over all recordings that meet the conditions, each on its own, as a batch.
    """
    from bench_service.cli.asking.watching import exit_code

    body = {
        "method": method,
        "recordings": recording,
        "calibrations": calibration,
        "parameters": dict(map(parameter, set_)),
        "unit": unit,
    }
    with connect(context.obj, server, drive=False) as client:
        if where:
            more = {"selection": selection_of(where), "each": each, "priority": priority}
            return submit(client, {**body, **more}, wait or server is None, as_json)
        result = call(client, "POST", "/api/v1/analyses", RESULT, json=body)
    _print_result(method, result, as_json)
    return exit_code(result["verdict"])


def recordings(
    context: typer.Context,
    recording: Annotated[str | None, typer.Argument(help="Id of one recording, to be shown whole")] = None,
    job: Annotated[str | None, typer.Option(help="Only of this job")] = None,
    unit: Annotated[str | None, typer.Option(help="Only of this unit")] = None,
    verdict: Verdict = None,
    since: Since = None,
    until: Until = None,
    label: Labelled = NO_ITEMS,
    text: Text = None,
    limit: Limit = 20,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List recordings, newest first, or show one."""
    from bench_service.cli.printing.tables import recording_table

    query = {"job": job, "unit": unit, "verdict": verdict, "since": since, "until": until, "label": label, "text": text}
    with connect(context.obj, server, drive=False) as client:
        if recording is not None:
            found = call(client, "GET", f"/api/v1/recordings/{segment(recording)}", ("id", "channels"))
            console.print_json(json.dumps(found))
            return
        page = newest(client, "/api/v1/recordings", limit, query)
    show(page if as_json else page["items"], as_json, recording_table)


def results(
    context: typer.Context,
    result: Annotated[str | None, typer.Argument(help="Id of one result, to be shown whole")] = None,
    budget: Annotated[
        str | None, typer.Option(help="With an id: only the uncertainty budget of this coefficient (gyro.K11)")
    ] = None,
    name: Annotated[str | None, typer.Option(help="Only of this procedure or method")] = None,
    unit: Annotated[str | None, typer.Option(help="Only of this unit")] = None,
    verdict: Verdict = None,
    since: Since = None,
    until: Until = None,
    label: Labelled = NO_ITEMS,
    text: Text = None,
    limit: Limit = 20,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List results, newest first, or show one with its tables, checks and verdict."""
    from bench_service.cli.printing.tables import result_table

    query = {"name": name, "unit": unit, "verdict": verdict, "since": since, "until": until}
    with connect(context.obj, server, drive=False) as client:
        if result is not None:
            found = call(client, "GET", f"/api/v1/results/{segment(result)}", (*RESULT, "name"))
            if budget is not None and not as_json:
                _print_budget(found, budget)
                return
            _print_result(found["name"], found, as_json)
            return
        page = newest(client, "/api/v1/results", limit, {**query, "label": label, "text": text})
    show(page if as_json else page["items"], as_json, result_table)


def _print_budget(result: dict[str, Any], coefficient: str) -> None:
    from bench_service.cli.printing.check_tables import budget_table

    try:
        console.print(budget_table(result["document"], coefficient))
    except KeyError as error:
        raise typer.BadParameter(f"{coefficient} is not among {error.args[0]}", param_hint="--budget") from error


def _print_result(name: str, result: dict[str, Any], as_json: bool) -> None:
    from bench_service.cli.printing.check_tables import check_table, show_warnings
    from bench_service.cli.printing.report_tables import report_tables

    if as_json:
        print(json.dumps(result, indent=2))
        return
    for table in report_tables(name, result["document"]):
        console.print(table)
    console.print(check_table(result["document"]))
    show_warnings(result["document"], console)
    console.print(f"verdict {result['verdict']}, result {result['id']}", soft_wrap=True)
