"""``bench calibrations`` and ``bench calibration``: a unit's calibrations, and which one of each triad counts."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bench_service.cli.asking.client import answer, connect
from bench_service.cli.files import check_folder, text_of, whole_file
from bench_service.cli.groups.decisions import By, Newest, Remark, UnitRecords
from bench_service.cli.options import AsJson, Server, console
from bench_service.cli.refusal import Refused

if TYPE_CHECKING:
    from rich.table import Table


def _table(items: list[dict[str, Any]]) -> "Table":
    from bench_service.cli.printing.tables import calibration_table

    return calibration_table(items)


calibration = typer.Typer(no_args_is_help=True, help="The current calibration of a triad: choose, approve, reject.")
RECORDS = UnitRecords("calibration", ("id", "triad", "current", "approval", "coefficients"), _table)


def calibrations(
    context: typer.Context,
    unit: str,
    triad: Annotated[str | None, typer.Option(help="gyro or accelerometer; without it, both")] = None,
    limit: Newest = 50,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List a unit's calibrations, newest first; at most one of each triad is current."""
    RECORDS.print_newest(context, unit, {"limit": limit, "triad": triad}, server, as_json)


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
    path, given = RECORDS.choice(unit, calibration_id, "choose", "triad", by_rule)
    RECORDS.post(context, path, {"by": by, "remark": remark, **given}, server, as_json)


RECORDS.add_approve_and_reject(calibration)


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
    RECORDS.post(context, RECORDS.path(unit), body, server, as_json)


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
        found = answer(client, "GET", RECORDS.path(unit, calibration_id, "export"), params=query)
    if output is None:
        print(found.text, end="")
        return
    with whole_file(output) as sink:
        sink.write(found.content)
    console.print(f"{output}: {len(found.content)} bytes", soft_wrap=True)
