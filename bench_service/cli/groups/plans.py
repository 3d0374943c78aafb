"""Commands before a job: what the bench can do, and previews of plans."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from bench_service.cli.asking.client import answer, call, connect, segment
from bench_service.cli.asking.lists import show
from bench_service.cli.completion import method_names, procedure_names
from bench_service.cli.files import text_of
from bench_service.cli.options import NO_ITEMS, AsJson, Server, Set, console, errors, parameter, wide
from bench_service.cli.refusal import Refused

PREVIEW = ("stations", "duration_s", "warnings", "violations", "predicted_uncertainties")


def procedures(
    context: typer.Context,
    name: Annotated[str | None, typer.Argument(help="With its parameters", autocompletion=procedure_names)] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List the procedures of the bench, or the parameters of one."""
    _catalogue(context, "procedures", name, server, as_json)


def methods(
    context: typer.Context,
    name: Annotated[str | None, typer.Argument(help="With its parameters", autocompletion=method_names)] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List the methods of analysing what is stored, or the parameters of one."""
    _catalogue(context, "methods", name, server, as_json)


def _catalogue(context: typer.Context, what: str, name: str | None, server: str | None, as_json: bool) -> None:
    from bench_service.cli.printing.tables import parameter_table, procedure_table

    with connect(context.obj, server, drive=False) as client:
        entries = answer(client, "GET", f"/api/v1/{what}").json()
    if name is None:
        show(entries, as_json, procedure_table)
        return
    found = next((entry for entry in entries if entry["name"] == name), None)
    if found is None:
        known = ", ".join(entry["name"] for entry in entries)
        raise Refused(f"{what} has no entry {name!r}; there are {known}")
    show(found, as_json, parameter_table)


def preview(
    context: typer.Context,
    procedure: Annotated[
        str | None, typer.Argument(help="The procedure; not with --plans", autocompletion=procedure_names)
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Serial of the unit")] = None,
    bench: Annotated[str | None, typer.Option(help="Bench, where there are several")] = None,
    set_: Set = NO_ITEMS,
    plans: Annotated[
        Path | None,
        typer.Option(exists=True, dir_okay=False, help="JSON list of plans: procedure, unit, parameters, bench"),
    ] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Preview a plan before anything moves: duration, expected uncertainties, warnings; or many plans at once.

    Exit code: 0 it can be run, 1 it exceeds a limit of the bench or is refused, 2 error.
    """
    if (plans is None) == (procedure is None):
        raise Refused("either a procedure with --unit is needed, or --plans with a file")
    if plans is not None:
        return _preview_many(context, _plans_of(plans), server, as_json)
    if unit is None:
        raise Refused("--unit: the serial of the unit is needed")
    body = {"unit": unit, "bench": bench, "parameters": dict(map(parameter, set_))}
    with connect(context.obj, server, drive=False) as client:
        made = call(client, "POST", f"/api/v1/procedures/{segment(str(procedure))}/preview", PREVIEW, json=body)
    if as_json:
        print(json.dumps(made, indent=2))
    else:
        _print_preview(made)
    return 1 if made["violations"] else 0


def _plans_of(file: Path) -> list[dict[str, Any]]:
    try:
        plans = json.loads(text_of(file))
    except ValueError as error:
        raise Refused(f"{file} is not JSON: {error}") from error
    if not isinstance(plans, list) or not all(isinstance(plan, dict) for plan in plans):
        raise Refused(f"{file}: a list of plans is needed, each an object with procedure, unit, parameters, bench")
    return plans


def _preview_many(context: typer.Context, plans: list[dict[str, Any]], server: str | None, as_json: bool) -> int:
    from bench_service.cli.printing.tables import outcome_table

    with connect(context.obj, server, drive=False) as client:
        outcomes = call(client, "POST", "/api/v1/previews", ("items",), json={"plans": plans})["items"]
    if as_json:
        print(json.dumps(outcomes, indent=2))
    else:
        wide().print(outcome_table(plans, outcomes))
    good = all(one["preview"] is not None and not one["preview"]["violations"] for one in outcomes)
    return 0 if good else 1


def _print_preview(made: dict[str, Any]) -> None:
    from bench_service.cli.printing.tables import uncertainty_table

    if made["predicted_uncertainties"]:
        console.print(uncertainty_table(made["predicted_uncertainties"]))
    for text, colour in ((made["violations"], "red"), (made["warnings"], "yellow")):
        for sentence in text:
            errors.print(f"{'limit' if colour == 'red' else 'warning'}: {sentence}", style=colour, soft_wrap=True)
    hours, megabytes = made["duration_s"] / 3600, made["data_bytes"] / 1e6
    basis = f"; {made['basis']}" if made["basis"] else ""
    console.print(
        f"{made['procedure']} {made['unit']}: {len(made['stations'])} stations, {hours:.2f} h of bench time, "
        f"about {megabytes:.0f} MB{basis}",
        soft_wrap=True,
    )
