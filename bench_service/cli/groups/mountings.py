"""``bench mounting``: who mounted which unit on which plate, and the azimuth read for it; asked step by step."""

import json
from typing import Annotated, Any

import typer

from bench_service.cli.asking.client import call, connect, segment
from bench_service.cli.asking.lists import newest, show
from bench_service.cli.options import AsJson, Key, Limit, Server, console, key_or_new

mounting = typer.Typer(no_args_is_help=True, help="Mountings of units on plates: enter one, list them, end one.")
PATH = "/api/v1/mountings"
SHOWN = ("id", "unit", "bench", "plate", "azimuth_deg", "azimuth_sd_arcsec")
By = Annotated[str | None, typer.Option(help="Name of the person who acts; default: this client")]
STEPS = (
    "1. Mount the unit on its plate, and the plate on the table; tighten by the passport.",
    "2. Connect supply and data, and wait until the unit has the room's temperature.",
    "3. Bring the table to its first orientation: all angles zero.",
    "4. Read the azimuth of the unit's prism by theodolite, in several rounds.",
)
"""Steps of a person before a mounting is entered (thesis 5.1)."""


@mounting.command("enter")
def enter(
    context: typer.Context,
    unit: Annotated[str, typer.Argument(help="Serial of the unit")],
    bench: Annotated[str | None, typer.Option(help="Bench; without it, the one of jobs that name none")] = None,
    plate: Annotated[str | None, typer.Option(help="Name of the plate; without it, the command asks")] = None,
    azimuth_deg: Annotated[
        float | None, typer.Option(help="Heading of the unit's x at zero angles, from north")
    ] = None,
    azimuth_sd_arcsec: Annotated[float | None, typer.Option(help="Standard uncertainty of that reading")] = None,
    mounted_at: Annotated[str | None, typer.Option(help="When; without it, now: 2026-11-30T08:00:00Z")] = None,
    instrument: Annotated[str, typer.Option(help="Instrument of the reading: theodolite and prism")] = "",
    by: By = None,
    remark: Annotated[str, typer.Option(help="Remark that is stored with the mounting")] = "",
    key: Key = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Enter a mounting. What the options leave out is asked, after the steps that lead to it."""
    if None in (plate, azimuth_deg, azimuth_sd_arcsec):
        for step in STEPS:
            typer.confirm(step, abort=True, default=True, err=True)
    body: dict[str, Any] = {
        "unit": unit,
        "bench": bench,
        "plate": typer.prompt("Plate", err=True) if plate is None else plate,
        "azimuth_deg": _number("Azimuth of the unit's x, deg from north", azimuth_deg),
        "azimuth_sd_arcsec": _number("Its standard uncertainty, arcsec", azimuth_sd_arcsec),
        "mounted_at": mounted_at,
        "instrument": instrument,
        "by": by,
        "remark": remark,
    }
    with connect(context.obj, server, drive=False) as client:
        headers = {"Idempotency-Key": key_or_new(key)}
        made = call(client, "POST", PATH, SHOWN, json=body, headers=headers)
    if as_json:
        print(json.dumps(made, indent=2))
    else:
        console.print(
            f"mounting {made['id']}: {made['unit']} on plate {made['plate']} of {made['bench']}, azimuth "
            f"{made['azimuth_deg']:.5f} deg ± {made['azimuth_sd_arcsec']:g} arcsec",
            soft_wrap=True,
        )


@mounting.command("list")
def list_(
    context: typer.Context,
    unit: Annotated[str | None, typer.Option(help="Only mountings of this unit")] = None,
    bench: Annotated[str | None, typer.Option(help="Only mountings on this bench")] = None,
    standing: Annotated[bool, typer.Option(help="Only mountings that are in place")] = False,
    limit: Limit = 20,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List mountings, newest first."""
    from bench_service.cli.printing.tables import mounting_table

    conditions = {"unit": unit, "bench": bench, "standing": True if standing else None}
    with connect(context.obj, server, drive=False) as client:
        page = newest(client, PATH, limit, conditions)
    show(page if as_json else page["items"], as_json, mounting_table)


@mounting.command("end")
def end(context: typer.Context, mounting_id: str, by: By = None, server: Server = None) -> None:
    """End a mounting: the unit was taken off."""
    with connect(context.obj, server, drive=False) as client:
        ended = call(client, "POST", f"{PATH}/{segment(mounting_id)}/end", SHOWN, json={"by": by})
    console.print(f"mounting {ended['id']} of {ended['unit']} has ended", soft_wrap=True)


def _number(question: str, given: float | None) -> float:
    return typer.prompt(question, type=float, err=True) if given is None else given
