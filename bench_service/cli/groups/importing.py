"""The command that imports recorded files: with a description, or with a proposed one that a person confirms."""

import json
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bench_service.cli.asking.client import call, connect
from bench_service.cli.files import text_of
from bench_service.cli.options import AsJson, Server, console, errors
from bench_service.cli.refusal import Refused

if TYPE_CHECKING:
    import httpx

RECORDING = ("id", "unit", "count", "channels", "rate_hz", "duration_s", "warnings")
"""Fields of a recording that the command reads."""
PROPOSAL = ("description", "unknown", "suspicious", "notes")
"""Fields of a proposal that the command reads."""


def import_(
    context: typer.Context,
    files: Annotated[list[Path], typer.Argument(exists=True, dir_okay=False)],
    description: Annotated[
        Path | None, typer.Option(exists=True, dir_okay=False, help="JSON file that says what is in them")
    ] = None,
    describe: Annotated[bool, typer.Option("--describe", help="Print the description that would be used")] = False,
    unit: Annotated[str | None, typer.Option(help="Serial of the unit, for a proposed description")] = None,
    form: Annotated[str | None, typer.Option("--format", help="Format of the file, where it is not recognised")] = None,
    table: Annotated[str | None, typer.Option(help="Topic, message type, archive's file")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Take a proposed description in which nothing is unknown")] = False,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Import a recorded file, or several that are columns of one recording.

    Without --description one is proposed from the file, shown, and used once it is confirmed.
    """
    if description is not None and (describe or unit or form or table or yes):
        raise Refused("--description is complete: leave out --describe, --unit, --format, --table and --yes")
    with connect(context.obj, server, drive=False) as client:
        if description is not None:
            text = text_of(description)
        else:
            proposal = _proposed(client, files, unit, form, table)
            _show(proposal)
            text = json.dumps(proposal["description"], indent=2)
            if describe:
                print(text)
                return
            _confirm(proposal, yes)
        recording = _import(client, files, text)
    if as_json:
        print(json.dumps(recording, indent=2))
    else:
        from bench_service.cli.printing.tables import recording_line

        console.print(recording_line(recording), soft_wrap=True)
    for warning in recording["warnings"]:
        errors.print(f"warning: {warning}", soft_wrap=True)


def _proposed(client: "httpx.Client", files: list[Path], unit: str | None, form: str | None, table: str | None) -> Any:
    if len(files) != 1:
        raise Refused("a description is proposed for a single file only: joined files need --description")
    known = {k: v for k, v in {"unit": unit, "format": form, "table": table}.items() if v is not None}
    with files[0].open("rb") as file:
        part = {"file": (files[0].name, file, "application/octet-stream")}
        return call(client, "POST", "/api/v1/recordings/describe", PROPOSAL, files=part, data=known)


def _import(client: "httpx.Client", files: list[Path], text: str) -> Any:
    with ExitStack() as closing:
        opened = [(path.name, closing.enter_context(path.open("rb"))) for path in files]
        parts = [("files", (name, file, "application/octet-stream")) for name, file in opened]
        return call(client, "POST", "/api/v1/recordings", RECORDING, files=parts, data={"description": text})


def _show(proposal: Any) -> None:
    """Show a proposal on standard error: standard output is for the description."""
    from bench_service.cli.options import wide_errors
    from bench_service.cli.printing.proposal_table import proposal_table

    rate = proposal.get("rate_hz")
    head = [f"{proposal['file']}: {proposal['title']}", f"{proposal['rows']} rows" if proposal["rows"] else ""]
    head += [f"table {proposal['table']}" if proposal["table"] else "", f"{rate:.7g} Hz" if rate else ""]
    errors.print(", ".join(filter(None, head)), soft_wrap=True)
    if proposal["columns"]:
        wide_errors().print(proposal_table(proposal["columns"]))
    for clock in proposal["clocks"]:
        rate = f"{clock['rate_hz']:.7g} Hz, {clock['arrival']}" if clock["rate_hz"] else clock["problem"]
        errors.print(f"clock {clock['column']}: {clock['meaning']}: {rate}", soft_wrap=True)
    for kind, style in (("note", ""), ("suspicious", "yellow"), ("unknown", "red")):
        for words in proposal["notes" if kind == "note" else kind]:
            errors.print(f"{kind}: {words}", style=style, soft_wrap=True)
    others = [t["name"] for t in proposal["tables"] if t["name"] != proposal["table"]]
    if others:
        errors.print(f"other tables (--table): {', '.join(others[:20])}", soft_wrap=True)


def _confirm(proposal: Any, yes: bool) -> None:
    """Let a person confirm a proposal. Raises `Refused`."""
    unknown = proposal["unknown"]
    if proposal["description"]["unit"] is None:
        raise Refused("give the serial of the unit (--unit)")
    if yes:
        if unknown:
            raise Refused(
                f"{len(unknown)} {'things are' if len(unknown) > 1 else 'thing is'} not known: save the description "
                "(--describe > FILE), settle them there, and give it as --description FILE"
            )
        return
    if not sys.stdin.isatty():
        raise Refused("the description is a proposal: confirm it with --yes, or give it as --description")
    if not typer.confirm("Is this what the file holds?", default=False, err=True):
        raise typer.Abort


def synthesise(
    context: typer.Context,
    kind: Annotated[str, typer.Option(help="gyro, or accelerometer")] = "gyro",
    quantization: Annotated[float, typer.Option(help="Q in arcsec, or µg·s")] = 0.0,
    random_walk: Annotated[float, typer.Option(help="N in deg/√h, or µg·√s")] = 0.0,
    bias_instability: Annotated[float, typer.Option(help="B in deg/h, or µg")] = 0.0,
    rate_random_walk: Annotated[float, typer.Option(help="K in deg/h/√h, or µg/√s")] = 0.0,
    rate_ramp: Annotated[float, typer.Option(help="R in deg/h/h, or µg/s")] = 0.0,
    rate: Annotated[float, typer.Option(help="Samples per second")] = 100.0,
    hours: Annotated[float, typer.Option(help="Length of the record")] = 1.0,
    seed: Annotated[int, typer.Option(help="The same seed gives the same record")] = 1,
    server: Server = None,
) -> None:
    """Make a recording of chosen noise, to try a method on: synthetic for ever, and of no unit's history."""
    body = {
        "kind": kind,
        "quantization": quantization,
        "random_walk": random_walk,
        "bias_instability": bias_instability,
        "rate_random_walk": rate_random_walk,
        "rate_ramp": rate_ramp,
        "rate_hz": rate,
        "duration_s": 3600.0 * hours,
        "seed": seed,
    }
    with connect(context.obj, server, drive=False) as client:
        made = call(client, "POST", "/api/v1/recordings/synthetic", ("id", "source"), json=body)
    console.print_json(json.dumps(made))
