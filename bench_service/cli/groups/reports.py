"""``bench report``: a result or a unit as a printed report, PDF/A-3."""

from pathlib import Path
from typing import Annotated

import typer

from bench_service.cli.asking.client import answer, connect, segment
from bench_service.cli.files import check_folder, whole_file
from bench_service.cli.options import Server, console
from bench_service.cli.refusal import Refused


def report(
    context: typer.Context,
    output: Annotated[Path, typer.Option("--output", "-o", dir_okay=False, help="File to write, .pdf")],
    result: Annotated[str | None, typer.Argument(help="Id of a result")] = None,
    unit: Annotated[str | None, typer.Option(help="Serial of a unit, in place of a result")] = None,
    server: Server = None,
) -> None:
    """Print the report of a result or of a unit to a file, PDF/A-3 with its data inside."""
    if (result is None) == (unit is None):
        raise Refused("exactly one of a result and --unit is printed")
    check_folder(output)
    path = f"results/{segment(result)}" if result is not None else f"units/{segment(unit or '')}"
    with connect(context.obj, server, drive=False) as client:
        data = answer(client, "GET", f"/api/v1/{path}/report.pdf").content
    with whole_file(output) as sink:
        sink.write(data)
    console.print(f"{output}: {len(data)} bytes", soft_wrap=True)
