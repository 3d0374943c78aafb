"""Commands about reservations: a bench or a unit is kept free until a moment."""

import json
from typing import Annotated

import typer

from bench_service.cli.asking.client import call, connect, segment
from bench_service.cli.asking.lists import newest, show
from bench_service.cli.options import AsJson, Key, Limit, Server, console, key_or_new
from bench_service.cli.printing.moments import moment

RESERVATION = ("id", "until", "holder")


def reservations(
    context: typer.Context,
    active: Annotated[bool, typer.Option(help="Only reservations that are active now")] = False,
    limit: Limit = 20,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List reservations, newest first."""
    from bench_service.cli.printing.tables import reservation_table

    with connect(context.obj, server, drive=False) as client:
        page = newest(client, "/api/v1/reservations", limit, {"active": True if active else None})
    show(page if as_json else page["items"], as_json, reservation_table)


def reserve(
    context: typer.Context,
    holder: Annotated[str, typer.Option(help="For whom")],
    bench: Annotated[str | None, typer.Option(help="Bench to reserve; give either this or --unit")] = None,
    unit: Annotated[str | None, typer.Option(help="Serial of the unit")] = None,
    minutes: Annotated[float | None, typer.Option(help="Duration [min]; give either this or --until")] = None,
    until: Annotated[str | None, typer.Option(help="End of the reservation: 2026-11-30T08:00:00Z")] = None,
    note: Annotated[str, typer.Option(help="Remark for others")] = "",
    key: Key = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Reserve a bench or a unit: jobs that name the reservation run, those of others wait."""
    body = {"bench": bench, "unit": unit, "holder": holder, "minutes": minutes, "until": until, "note": note}
    with connect(context.obj, server, drive=False) as client:
        headers = {"Idempotency-Key": key_or_new(key)}
        made = call(client, "POST", "/api/v1/reservations", RESERVATION, json=body, headers=headers)
    if as_json:
        print(json.dumps(made, indent=2))
    else:
        console.print(f"reservation {made['id']} of {made['holder']} until {moment(made['until'])}", soft_wrap=True)


def unreserve(context: typer.Context, reservation: str, server: Server = None) -> None:
    """End a reservation before its time: jobs that waited for it may start."""
    with connect(context.obj, server, drive=False) as client:
        ended = call(client, "DELETE", f"/api/v1/reservations/{segment(reservation)}", RESERVATION)
    console.print(f"reservation {ended['id']} of {ended['holder']} has ended", soft_wrap=True)
