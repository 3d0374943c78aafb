"""Commands of raw data over the years: sizes and predictions, retention, archive, restoration, and holds."""

import json
from typing import Annotated, Any

import typer

from bench_service.cli.asking.client import call, connect, segment
from bench_service.cli.options import AsJson, Server, console, errors, wide

storage = typer.Typer(
    invoke_without_command=True, help="Size of the database, and raw data over the years: retention, archive, holds."
)
PLAN = ("recordings", "stored_bytes", "kept", "done")
Days = Annotated[float | None, typer.Option(help="Age in days; without it as the settings say")]
DoIt = Annotated[bool, typer.Option("--do-it", help="Do it; without this option only report what would be removed")]


@storage.callback()
def sizes(context: typer.Context, server: Server = None, as_json: AsJson = False) -> None:
    """Show the size of the database, where raw data are, and how large it will be."""
    if context.invoked_subcommand is not None:
        return
    from bench_service.cli.printing.storage_tables import prediction_table, share_table

    with connect(context.obj, server, drive=False) as client:
        found = call(client, "GET", "/api/v1/storage", ("stored_bytes", "raw", "predicted"))
    if as_json:
        print(json.dumps(found, indent=2))
        return
    free = "" if found["free_bytes"] is None else f", {found['free_bytes'] / 1e9:.2f} GB free on its disk"
    reusable = "" if not found["reusable_bytes"] else f", {found['reusable_bytes'] / 1e9:.2f} GB of it to be used again"
    console.print(f"database: {found['stored_bytes'] / 1e9:.2f} GB{reusable}{free}", soft_wrap=True)
    wide().print(share_table(found["raw"]))
    wide().print(prediction_table(found["predicted"], found["growth"]))
    if found["full_at"] is not None:
        console.print(f"at this growth the disk is full on {found['full_at'][:10]}", soft_wrap=True)


@storage.command()
def retain(
    context: typer.Context, days: Days = None, do_it: DoIt = False, server: Server = None, as_json: AsJson = False
) -> None:
    """Say which routine passes' raw data are old enough to be removed; with --do-it remove them."""
    _apply(context, "retention", days, do_it, server, as_json)


@storage.command()
def archive(
    context: typer.Context, days: Days = None, do_it: DoIt = False, server: Server = None, as_json: AsJson = False
) -> None:
    """Say which raw data are old enough for the archive; with --do-it move them there."""
    _apply(context, "archive", days, do_it, server, as_json)


@storage.command()
def restore(context: typer.Context, recording: str, server: Server = None) -> None:
    """Bring a recording's raw data back from the archive into the database."""
    with connect(context.obj, server, drive=False) as client:
        found = call(client, "POST", f"/api/v1/recordings/{segment(recording)}/restore", ("id", "raw"))
    console.print(f"recording {found['id']}: {found['raw']}")


@storage.command()
def hold(
    context: typer.Context,
    recording: str,
    reason: Annotated[str, typer.Option(help="Why it is held")],
    server: Server = None,
) -> None:
    """Hold a recording's raw data: no rule removes them."""
    with connect(context.obj, server, drive=False) as client:
        path = f"/api/v1/recordings/{segment(recording)}/holds"
        found = call(client, "POST", path, ("id",), json={"reason": reason})
    console.print(f"hold {found['id']} on recording {recording}", soft_wrap=True)


@storage.command()
def release(context: typer.Context, hold: str, server: Server = None) -> None:
    """Release a hold on raw data."""
    with connect(context.obj, server, drive=False) as client:
        found = call(client, "POST", f"/api/v1/storage/holds/{segment(hold)}/release", ("recording",))
    console.print(f"recording {found['recording']} is no longer held by {hold}", soft_wrap=True)


def _apply(
    context: typer.Context, rule: str, days: float | None, do_it: bool, server: str | None, as_json: bool
) -> None:
    body: dict[str, Any] = {"days": days, "dry_run": not do_it}
    with connect(context.obj, server, drive=False) as client:
        plan = call(client, "POST", f"/api/v1/storage/{rule}", PLAN, json=body)
    if as_json:
        print(json.dumps(plan, indent=2))
        return
    word = {"retention": "removed", "archive": "archived"}[rule]
    kept = ", ".join(f"{number} by {reason}" for reason, number in plan["kept"].items()) or "none"
    size = plan["done_bytes"] if do_it else plan["stored_bytes"]
    number = plan["done"] if do_it else f"{len(plan['recordings'])}{'+' if len(plan['recordings']) == 200 else ''}"
    tense = f"were {word}" if do_it else f"would be {word} (only with --do-it)"
    console.print(
        f"raw data of {number} recordings, {size / 1e6:.1f} MB, older than {plan['days']:g} days {tense}; kept: {kept}",
        soft_wrap=True,
    )
    for fault in plan["faults"]:
        errors.print(fault, style="red", soft_wrap=True)
