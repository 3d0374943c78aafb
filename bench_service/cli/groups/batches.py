"""Commands of batches of analyses: submit one by a query, list, watch, cancel and retry."""

import json
from typing import TYPE_CHECKING, Any

import typer

from bench_service.cli.asking.client import call, connect, segment
from bench_service.cli.asking.lists import newest, show
from bench_service.cli.asking.moments import moment_of
from bench_service.cli.options import AsJson, Limit, Server, console
from bench_service.cli.refusal import Refused

if TYPE_CHECKING:
    import httpx

batches = typer.Typer(no_args_is_help=True, help="Batches of analyses: a method over many recordings.")
BATCH = ("id", "state", "total", "counts", "ended_at")
"""Fields of a batch that commands read."""
BATCHES = "/api/v1/analyses/batches"
CONDITIONS = ("unit", "procedure", "job", "verdict", "since", "until", "text", "simulated")
"""Conditions that may be given once; `label` and `id` may be repeated."""


def selection_of(where: list[str]) -> dict[str, Any]:
    """Return the selection of recordings that ``name=value`` conditions state. Raises `Refused` with the known
    names.
    """
    selection: dict[str, Any] = {}
    for text in where:
        name, equals, value = text.partition("=")
        if not (equals and value):
            raise Refused(f"--where {text}: expected name=value")
        if name in ("label", "id"):
            selection.setdefault("labels" if name == "label" else "ids", []).append(value)
        elif name not in CONDITIONS:
            raise Refused(f"--where {text}: the conditions are {', '.join((*CONDITIONS, 'label', 'id'))}")
        elif name in selection:
            raise Refused(f"--where {name}: given twice; label and id may be repeated")
        else:
            selection[name] = moment_of(f"--where {name} =", value) if name in ("since", "until") else value
    return selection


def submit(client: "httpx.Client", body: dict[str, Any], wait: bool, as_json: bool) -> int:
    """Submit a batch and watch it until its end. Exit code: 0 all analysed, 1 some failed, 2 cancelled or refused."""
    batch = call(client, "POST", "/api/v1/analyses", BATCH, json=body)
    if wait:
        batch = _watch(client, batch)
    _print(batch, as_json)
    return {"succeeded": 0, "failed": 1, "cancelled": 2}.get(batch["state"], 0)


@batches.command("list")
def list_(context: typer.Context, limit: Limit = 20, server: Server = None, as_json: AsJson = False) -> None:
    """List batches, newest first."""
    from bench_service.cli.printing.tables import batch_table

    with connect(context.obj, server, drive=False) as client:
        page = newest(client, BATCHES, limit, {})
    show(page if as_json else page["items"], as_json, batch_table)


@batches.command()
def watch(context: typer.Context, batch: str, server: Server = None, as_json: AsJson = False) -> int:
    """Follow a batch until it has ended. Exit code: 0 all analysed, 1 some failed, 2 cancelled."""
    with connect(context.obj, server, drive=False) as client:
        found = _watch(client, call(client, "GET", f"{BATCHES}/{segment(batch)}", BATCH))
    _print(found, as_json)
    return {"succeeded": 0, "failed": 1}.get(found["state"], 2)


@batches.command()
def failures(
    context: typer.Context, batch: str, limit: Limit = 20, server: Server = None, as_json: AsJson = False
) -> None:
    """List the failed tasks of a batch: their recordings, and why."""
    with connect(context.obj, server, drive=False) as client:
        path = f"{BATCHES}/{segment(batch)}/tasks"
        found = call(client, "GET", path, ("items",), params={"state": "failed", "limit": min(500, limit)})
    if as_json:
        print(json.dumps(found, indent=2))
        return
    for task in found["items"]:
        why = task["failure"] or {"kind": "unknown", "message": ""}
        console.print(
            f"{task['number']}: {', '.join(task['recordings'])}: {why['kind']}: {why['message']}", soft_wrap=True
        )


@batches.command()
def cancel(context: typer.Context, batch: str, server: Server = None, as_json: AsJson = False) -> None:
    """Cancel a batch: what waits is not analysed, what runs ends by itself, results stay."""
    _act(context, batch, "cancel", server, as_json)


@batches.command()
def retry(context: typer.Context, batch: str, server: Server = None, as_json: AsJson = False) -> None:
    """Queue the failed and cancelled tasks of a batch that has ended again."""
    _act(context, batch, "retry", server, as_json)


def _act(context: typer.Context, batch: str, act: str, server: str | None, as_json: bool) -> None:
    with connect(context.obj, server, drive=False) as client:
        found = call(client, "POST", f"{BATCHES}/{segment(batch)}/{act}", BATCH)
        if server is None and act == "retry":  # without a server nobody else runs it
            found = _watch(client, found)
    _print(found, as_json)


def _watch(client: "httpx.Client", batch: dict[str, Any]) -> dict[str, Any]:
    from bench_service.cli.asking.watching import watch_batch

    return watch_batch(client, batch, f"{BATCHES}/{segment(batch['id'])}", BATCH, console)


def _print(batch: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print(json.dumps(batch, indent=2))
        return
    counts = ", ".join(f"{number} {state}" for state, number in batch["counts"].items() if number)
    console.print(f"batch {batch['id']} {batch['state']}: {batch['total']} analyses, {counts}", soft_wrap=True)
