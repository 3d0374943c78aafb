"""``bench corrections`` and ``bench correction``: a unit's correction sets for temperature, converter, thermometers."""

import json
from typing import Annotated, Any

import typer

from bench_service.cli.asking.client import call, connect, segment
from bench_service.cli.groups.calibrations import By, Remark
from bench_service.cli.options import AsJson, Server, console, wide

correction = typer.Typer(no_args_is_help=True, help="A unit's corrections that count: chosen, approved, rejected.")
SHOWN = ("id", "kind", "current", "approval", "unusable")


def corrections(
    context: typer.Context,
    unit: str,
    kind: Annotated[
        str | None, typer.Option(help="thermal, converter, thermometers or gyros; without it, all of them")
    ] = None,
    limit: Annotated[int, typer.Option(min=1, max=500, help="The newest so many")] = 50,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List a unit's corrections, newest first; at most one of each kind is current."""
    from bench_service.cli.printing.tables import correction_table

    query: dict[str, Any] = {"limit": limit} if kind is None else {"limit": limit, "kind": kind}
    with connect(context.obj, server, drive=False) as client:
        items = call(client, "GET", _path(unit), ("items",), params=query)["items"]
    if as_json:
        print(json.dumps(items, indent=2))
        return
    wide().print(correction_table(items))
    for one in items:
        if one["current"] and one["unusable"]:
            console.print(one["unusable"], style="yellow", soft_wrap=True)


@correction.command("choose")
def choose(
    context: typer.Context,
    unit: str,
    correction_id: str,
    by: By = None,
    remark: Remark = "",
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Make a correction the one of its kind that new jobs use; one of a result that failed needs a remark."""
    body = {"by": by, "remark": remark}
    _post(context, f"{_path(unit)}/{segment(correction_id)}/current", body, server, as_json)


@correction.command("approve")
def approve(
    context: typer.Context,
    unit: str,
    correction_id: str,
    valid_until: Annotated[str | None, typer.Option(help="End of its validity, as 2027-06-30T00:00:00Z")] = None,
    by: By = None,
    remark: Remark = "",
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Approve a correction, and say until when it is valid."""
    body = {"by": by, "remark": remark, "valid_until": valid_until}
    _post(context, f"{_path(unit)}/{segment(correction_id)}/approve", body, server, as_json)


@correction.command("reject")
def reject(
    context: typer.Context,
    unit: str,
    correction_id: str,
    remark: Annotated[str, typer.Option(help="Why it may not be used")],
    by: By = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Reject a correction: no new job uses it, also where it is current."""
    body = {"by": by, "remark": remark}
    _post(context, f"{_path(unit)}/{segment(correction_id)}/reject", body, server, as_json)


def _path(unit: str) -> str:
    return f"/api/v1/units/{segment(unit)}/corrections"


def _post(context: typer.Context, path: str, body: dict[str, Any], server: str | None, as_json: bool) -> None:
    from bench_service.cli.printing.tables import correction_table

    with connect(context.obj, server, drive=False) as client:
        found = call(client, "POST", path, SHOWN, json=body)
    if as_json:
        print(json.dumps(found, indent=2))
    else:
        wide().print(correction_table([found]))
