"""``bench corrections`` and ``bench correction``: a unit's correction sets for temperature, converter, thermometers."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from bench_service.cli.groups.decisions import By, Newest, Remark, UnitRecords
from bench_service.cli.options import AsJson, Server

if TYPE_CHECKING:
    from rich.table import Table


def _table(items: list[dict[str, Any]]) -> "Table":
    from bench_service.cli.printing.tables import correction_table

    return correction_table(items)


correction = typer.Typer(no_args_is_help=True, help="A unit's current corrections: choose, approve, reject.")
RECORDS = UnitRecords("correction", ("id", "kind", "current", "verdict", "approval", "unusable", "not_current"), _table)


def corrections(
    context: typer.Context,
    unit: str,
    kind: Annotated[
        str | None, typer.Option(help="thermal, converter, thermometers or gyros; without it, all of them")
    ] = None,
    limit: Newest = 50,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List a unit's corrections, newest first; at most one of each kind is current, and the others say why not."""
    RECORDS.print_newest(context, unit, {"limit": limit, "kind": kind}, server, as_json)


@correction.command("choose")
def choose(
    context: typer.Context,
    unit: str,
    correction_id: Annotated[str | None, typer.Argument(help="Id of the correction; none with --by-rule")] = None,
    by_rule: Annotated[
        str | None, typer.Option(help="Give this kind back to the rule: thermal, converter, thermometers, gyros")
    ] = None,
    by: By = None,
    remark: Remark = "",
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Make a correction the one of its kind that new jobs use; one of a result that failed needs a remark."""
    path, given = RECORDS.choice(unit, correction_id, "current", "kind", by_rule)
    RECORDS.post(context, path, {"by": by, "remark": remark, **given}, server, as_json)


RECORDS.add_approve_and_reject(correction)
