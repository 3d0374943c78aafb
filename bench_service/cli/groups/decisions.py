"""Lists, approvals and rejections of a unit's records: the same commands for calibrations and for corrections."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bench_service.cli.asking.client import call, connect, segment
from bench_service.cli.asking.lists import show
from bench_service.cli.options import AsJson, Server, console
from bench_service.cli.refusal import Refused

if TYPE_CHECKING:
    from rich.table import Table

By = Annotated[str | None, typer.Option(help="Person who decides; default: this client")]
Remark = Annotated[str, typer.Option(help="Remark that is kept with the decision")]
Newest = Annotated[int, typer.Option(min=1, max=500, help="Number of the newest ones")]


@dataclass(frozen=True)
class UnitRecords:
    """Commands on a unit's records of one kind (calibrations, corrections) on which people decide: addresses, table,
    columns.
    """

    name: str
    """Name of one such record; with an s, its part of the service's paths."""
    shown: tuple[str, ...]
    """Fields of an answer that are needed to show it."""
    table: "Callable[[list[dict[str, Any]]], Table]"

    def path(self, unit: str, *more: str) -> str:
        """Return the path of a unit's records in the API, or of something below it."""
        return "/".join(("/api/v1/units", *map(segment, (unit, f"{self.name}s", *more))))

    def print_newest(
        self, context: typer.Context, unit: str, query: dict[str, Any], server: str | None, as_json: bool
    ) -> None:
        """Print a unit's newest records, why a current one is not usable and why another is not current.

        A condition of the query that is None is left out.
        """
        given = {name: value for name, value in query.items() if value is not None}
        with connect(context.obj, server, drive=False) as client:
            items = call(client, "GET", self.path(unit), ("items",), params=given)["items"]
        show(items, as_json, self.table)
        for one in () if as_json else items:
            if one["current"] and one["unusable"]:
                console.print(one["unusable"], style="yellow", soft_wrap=True)
            if why := one.get("not_current"):  # calibrations have none: their verdict and origin say it
                console.print(why, style="dim", soft_wrap=True)

    def choice(
        self, unit: str, record: str | None, verb: str, group: str, by_rule: str | None
    ) -> tuple[str, dict[str, str]]:
        """Return path and body of the choice of one record by `verb`, or of giving its `group` (a triad, a kind) back
        to the rule. Raises `Refused` unless exactly one of the two is named.
        """
        if record is not None and by_rule is None:
            return self.path(unit, record, verb), {}
        if record is None and by_rule is not None:
            return self.path(unit, "choose-by-rule"), {group: by_rule}
        raise Refused(f"exactly one of {self.name.upper()}_ID and --by-rule {group.upper()} is needed")

    def post(self, context: typer.Context, path: str, body: dict[str, Any], server: str | None, as_json: bool) -> None:
        """Send a decision to the service, and print the record as it is then. Raises `Refused`."""
        with connect(context.obj, server, drive=False) as client:
            found = call(client, "POST", path, self.shown, json=body)
        show(found if as_json else [found], as_json, self.table)

    def add_approve_and_reject(self, group: typer.Typer) -> None:
        """Add the commands `approve` and `reject` for this kind of record to its group of commands."""
        shown = f"{self.name}_id"

        @group.command("approve", help=f"Approve a {self.name}, and say until when it is valid.")
        def approve(
            context: typer.Context,
            unit: str,
            record: Annotated[str, typer.Argument(metavar=shown)],
            valid_until: Annotated[
                str | None, typer.Option(help="End of its validity, as 2027-06-30T00:00:00Z")
            ] = None,
            by: By = None,
            remark: Remark = "",
            server: Server = None,
            as_json: AsJson = False,
        ) -> None:
            body = {"by": by, "remark": remark, "valid_until": valid_until}
            self.post(context, self.path(unit, record, "approve"), body, server, as_json)

        @group.command("reject", help=f"Reject a {self.name}: no new job uses it, also where it is current.")
        def reject(
            context: typer.Context,
            unit: str,
            record: Annotated[str, typer.Argument(metavar=shown)],
            remark: Annotated[str, typer.Option(help="Why it may not be used")],
            by: By = None,
            server: Server = None,
            as_json: AsJson = False,
        ) -> None:
            self.post(context, self.path(unit, record, "reject"), {"by": by, "remark": remark}, server, as_json)
