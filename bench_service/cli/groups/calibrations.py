"""``bench calibrations`` and ``bench calibration``: a unit's calibrations, and which one of each triad counts."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from bench_service.cli.asking.client import answer, call, connect, segment
from bench_service.cli.files import check_folder, text_of, whole_file
from bench_service.cli.options import AsJson, Server, console, wide
from bench_service.cli.refusal import Refused

calibration = typer.Typer(no_args_is_help=True, help="The current calibration of a triad: choose, approve, reject.")

SHOWN = ("id", "triad", "current", "approval", "coefficients")
By = Annotated[str | None, typer.Option(help="Person who decides; default: this client")]
Remark = Annotated[str, typer.Option(help="Remark that is kept with the decision")]


def calibrations(
    context: typer.Context,
    unit: str,
    triad: Annotated[str | None, typer.Option(help="gyro or accelerometer; without it, both")] = None,
    limit: Annotated[int, typer.Option(min=1, max=500, help="Number of the newest ones")] = 50,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List a unit's calibrations, newest first; at most one of each triad is current."""
    from bench_service.cli.printing.tables import calibration_table

    query: dict[str, Any] = {"limit": limit} if triad is None else {"limit": limit, "triad": triad}
    with connect(context.obj, server, drive=False) as client:
        items = call(client, "GET", _path(unit), ("items",), params=query)["items"]
    if as_json:
        print(json.dumps(items, indent=2))
        return
    wide().print(calibration_table(items))
    for one in items:
        if one["current"] and one["unusable"]:
            console.print(one["unusable"], style="yellow", soft_wrap=True)


@calibration.command("choose")
def choose(
    context: typer.Context,
    unit: str,
    calibration_id: Annotated[str | None, typer.Argument(help="Id of the calibration; none with --by-rule")] = None,
    by_rule: Annotated[str | None, typer.Option(help="Give this triad back to the rule: gyro, accelerometer")] = None,
    by: By = None,
    remark: Remark = "",
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Make a calibration the one of its triad that new jobs use; one that failed needs a remark."""
    body: dict[str, Any] = {"by": by, "remark": remark}
    if (calibration_id is None) == (by_rule is None):
        raise Refused("exactly one of CALIBRATION_ID and --by-rule TRIAD is needed")
    if by_rule is not None:
        _post(context, f"{_path(unit)}/choose-by-rule", {**body, "triad": by_rule}, server, as_json)
    else:
        _post(context, f"{_path(unit)}/{segment(calibration_id or '')}/choose", body, server, as_json)


@calibration.command("approve")
def approve(
    context: typer.Context,
    unit: str,
    calibration_id: str,
    valid_until: Annotated[str | None, typer.Option(help="End of its validity, as 2027-06-30T00:00:00Z")] = None,
    by: By = None,
    remark: Remark = "",
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Approve a calibration, and say until when it is valid."""
    body = {"by": by, "remark": remark, "valid_until": valid_until}
    _post(context, f"{_path(unit)}/{segment(calibration_id)}/approve", body, server, as_json)


@calibration.command("reject")
def reject(
    context: typer.Context,
    unit: str,
    calibration_id: str,
    remark: Annotated[str, typer.Option(help="Why it may not be used")],
    by: By = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Reject a calibration: no new job uses it, also where it is current."""
    body = {"by": by, "remark": remark}
    _post(context, f"{_path(unit)}/{segment(calibration_id)}/reject", body, server, as_json)


@calibration.command("enter")
def enter(
    context: typer.Context,
    unit: str,
    file: Annotated[Path, typer.Argument(help="JSON: triad, origin, coefficients (name, value, unit, uncertainty)")],
    choose_it: Annotated[bool, typer.Option("--choose", help="Make it the triad's current one at once")] = False,
    by: By = None,
    remark: Remark = "",
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Enter known coefficients of a triad with their standard uncertainties and their origin, from a JSON file."""
    try:
        body = json.loads(text_of(file))
    except ValueError as error:
        raise Refused(f"{file}: no JSON: {error}") from error
    if not isinstance(body, dict):
        raise Refused(f"{file}: expected an object with triad, origin and coefficients")
    given = {"by": by, "remark": remark or None, "choose": choose_it or None}
    body |= {name: value for name, value in given.items() if value is not None}
    _post(context, _path(unit), body, server, as_json)


@calibration.command("export")
def export(
    context: typer.Context,
    unit: str,
    calibration_id: str,
    form: Annotated[
        str,
        typer.Option(
            "--format",
            help="json, c, python, kalibr, kalibr-imu, openvins, ardupilot, px4, imucal, matlab, psins, pyins, navego",
        ),
    ] = "json",
    other: Annotated[
        str | None, typer.Option(help="Calibration of the other triad; without it, of the same result or current")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write; without it, standard output")
    ] = None,
    server: Server = None,
) -> None:
    """Export a calibration in the form that other software applies."""
    query = {"format": form} if other is None else {"format": form, "other": other}
    if output is not None:
        check_folder(output)
    with connect(context.obj, server, drive=False) as client:
        found = answer(client, "GET", f"{_path(unit)}/{segment(calibration_id)}/export", params=query)
    if output is None:
        print(found.text, end="")
        return
    with whole_file(output) as sink:
        sink.write(found.content)
    console.print(f"{output}: {len(found.content)} bytes", soft_wrap=True)


def _path(unit: str) -> str:
    return f"/api/v1/units/{segment(unit)}/calibrations"


def _post(context: typer.Context, path: str, body: dict[str, Any], server: str | None, as_json: bool) -> None:
    from bench_service.cli.printing.tables import calibration_table

    with connect(context.obj, server, drive=False) as client:
        found = call(client, "POST", path, SHOWN, json=body)
    if as_json:
        print(json.dumps(found, indent=2))
    else:
        wide().print(calibration_table([found]))
