"""``bench units``: units under test, and the history of one."""

import json
from typing import Annotated

import typer

from bench_service.cli.asking.client import answer, call, connect, segment
from bench_service.cli.asking.lists import show
from bench_service.cli.options import AsJson, Server, console


def units(
    context: typer.Context,
    serial: Annotated[str | None, typer.Argument(help="One unit, to be shown whole")] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List the units with what is current of each, or show one."""
    from bench_service.cli.printing.tables import unit_table

    with connect(context.obj, server, drive=False) as client:
        if serial is not None:
            console.print_json(json.dumps(call(client, "GET", f"/api/v1/units/{segment(serial)}", ("serial",))))
            return
        found = answer(client, "GET", "/api/v1/units").json()
    show(found, as_json, unit_table)
