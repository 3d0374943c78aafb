"""``bench manual``: command an idle bench by hand, under a lease that ends by itself."""

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bench_service.cli.asking.client import answer, call, connect, segment
from bench_service.cli.groups.benches import bench_of
from bench_service.cli.options import AsJson, Key, Server, console, key_or_new, wide
from bench_service.cli.printing.moments import moment
from bench_service.wall_clock import pause

if TYPE_CHECKING:
    import httpx

manual = typer.Typer(no_args_is_help=True, help="Command an idle bench by hand, within its limits.")
LEASE = ("id", "bench", "holder", "until", "ended_at", "ended_because", "safe")
DEMAND = ("key", "kind", "state", "over", "text")
LOOK_S = 0.1
"""Interval between two looks at what became of a demand [s]."""
Bench = Annotated[str | None, typer.Option(help="Bench; default: the one in the settings, or the only one")]
By = Annotated[str | None, typer.Option(help="Holder of the lease; default: this client")]
Minutes = Annotated[float, typer.Option(help="Duration from now [min]; then the lease ends by itself")]
NoWait = Annotated[bool, typer.Option("--no-wait", help="Return once the demand is accepted")]


@manual.command("start")
def start(
    context: typer.Context,
    reason: Annotated[str, typer.Option(help="Why the bench is driven by hand")],
    minutes: Minutes = 10.0,
    unit: Annotated[str | None, typer.Option(help="Unit on the table; without it, the bench's first one")] = None,
    reservation: Annotated[str | None, typer.Option(help="Own reservation of the bench or the unit")] = None,
    bench: Bench = None,
    by: By = None,
    key: Key = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Begin manual mode on an idle bench. No job starts there before it has ended and the bench is safe."""
    body = {"reason": reason, "minutes": minutes, "unit": unit, "reservation": reservation, "by": by}
    with connect(context.obj, server, drive=False) as client:
        path = _path(bench_of(client, context.obj, bench))
        made = call(client, "POST", path, LEASE, json=body, headers={"Idempotency-Key": key_or_new(key)})
    _say(made, as_json, f"bench {made['bench']} is in manual mode by {made['holder']} until {moment(made['until'])}")


@manual.command("renew")
def renew(
    context: typer.Context, minutes: Minutes = 10.0, bench: Bench = None, by: By = None, server: Server = None
) -> None:
    """Move the end of the lease."""
    with connect(context.obj, server, drive=False) as client:
        path = _lease_path(client, bench_of(client, context.obj, bench))
        lease = call(client, "POST", f"{path}/renew", LEASE, json={"minutes": minutes, "by": by})
    console.print(f"manual mode of bench {lease['bench']} ends at {moment(lease['until'])}", soft_wrap=True)


@manual.command("end")
def end(context: typer.Context, bench: Bench = None, by: By = None, server: Server = None) -> int:
    """End manual mode, one's own or another's; exit code 0 once the bench is safe, 1 where it is not."""
    with connect(context.obj, server, drive=False) as client:
        path = _lease_path(client, bench_of(client, context.obj, bench))
        lease = call(client, "POST", f"{path}/end", LEASE, json={"by": by})
        while lease["ended_at"] is None:
            pause(LOOK_S)
            lease = call(client, "GET", path, LEASE)
    state = "and was safe before" if lease["safe"] is None else "it is safe" if lease["safe"] else "IT IS NOT SAFE"
    console.print(f"manual mode of bench {lease['bench']} is over, {state}: {lease['ended_because']}", soft_wrap=True)
    return 1 if lease["safe"] is False else 0


@manual.command("home")
def home(
    context: typer.Context,
    bench: Bench = None,
    by: By = None,
    no_wait: NoWait = False,
    key: Key = None,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Move all axes to zero. A table that does not know its zero is homed by a person, at its controller."""
    return _demand(context, server, bench, key, no_wait, as_json, {"kind": "home", "by": by})


@manual.command("go")
def go(
    context: typer.Context,
    outer_deg: Annotated[float | None, typer.Option(help="Outer axis; without it, it stays")] = None,
    middle_deg: Annotated[float | None, typer.Option(help="Middle axis; without it, it stays")] = None,
    inner_deg: Annotated[float | None, typer.Option(help="Inner axis; without it, it stays")] = None,
    bench: Bench = None,
    by: By = None,
    no_wait: NoWait = False,
    key: Key = None,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Move axes to angles, and wait until they rest."""
    body = {"kind": "go_to", "outer_deg": outer_deg, "middle_deg": middle_deg, "inner_deg": inner_deg, "by": by}
    return _demand(context, server, bench, key, no_wait, as_json, body)


@manual.command("rate")
def rate(
    context: typer.Context,
    axis: Annotated[str, typer.Argument(help="outer, middle or inner")],
    rate_deg_s: Annotated[float, typer.Argument(help="Rate, signed: write -- before a negative one")],
    duration_s: Annotated[float, typer.Option(help="Duration from rest to rest")],
    ramp_s: Annotated[
        float | None, typer.Option(help="Ramp at begin and end [s]; default: by the axis' acceleration")
    ] = None,
    bench: Bench = None,
    by: By = None,
    no_wait: NoWait = False,
    key: Key = None,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Turn one axis at a constant rate for a stated time. `bench manual halt` ends it earlier."""
    body = {"kind": "rate", "axis": axis, "rate_deg_s": rate_deg_s, "duration_s": duration_s, "ramp_s": ramp_s}
    return _demand(context, server, bench, key, no_wait, as_json, {**body, "by": by})


@manual.command("halt")
def halt(
    context: typer.Context, bench: Bench = None, by: By = None, server: Server = None, as_json: AsJson = False
) -> int:
    """End a rate or a move: bring the table to rest."""
    return _demand(context, server, bench, None, False, as_json, {"kind": "halt", "by": by})


@manual.command("chamber")
def chamber(
    context: typer.Context,
    temperature_c: Annotated[float, typer.Argument(help="Set point of the air: write -- before a negative one")],
    ramp_c_min: Annotated[float | None, typer.Option(help="Without it, the fastest that the bench allows")] = None,
    bench: Bench = None,
    by: By = None,
    key: Key = None,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Command the chamber's air to a temperature; returns once the controller has the set point."""
    body = {"kind": "chamber", "temperature_c": temperature_c, "ramp_c_min": ramp_c_min, "by": by}
    return _demand(context, server, bench, key, False, as_json, body)


@manual.command("supply")
def supply(
    context: typer.Context,
    state: Annotated[str, typer.Argument(help="on or off")],
    voltage_v: Annotated[float | None, typer.Option(help="Without it, nominal")] = None,
    current_a: Annotated[float | None, typer.Option(help="Current limit; without it, nominal")] = None,
    bench: Bench = None,
    by: By = None,
    key: Key = None,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Switch the unit's supply on or off."""
    body: dict[str, Any] = {"kind": f"supply_{state}", "by": by}
    if state == "on":
        body |= {"voltage_v": voltage_v, "current_a": current_a}
    return _demand(context, server, bench, key, False, as_json, body)


@manual.command("read")
def read(context: typer.Context, bench: Bench = None, server: Server = None, as_json: AsJson = False) -> None:
    """Read the devices as they are now: angles, rates, air, supply, the unit's channels, status words."""
    from bench_service.cli.printing.tables import live_table

    with connect(context.obj, server, drive=False) as client:
        name = bench_of(client, context.obj, bench)
        live = call(client, "GET", f"/api/v1/benches/{segment(name)}", ("live",))["live"]
    if as_json:
        print(json.dumps(live, indent=2))
    elif live is None or live["devices"] is None:
        console.print(f"bench {name}: no process has its devices open; `bench manual start` does", soft_wrap=True)
    else:
        wide().print(live_table(name, live))


def _path(bench: str) -> str:
    return f"/api/v1/benches/{segment(bench)}/manual"


def _lease_path(client: "httpx.Client", bench: str) -> str:
    """Path of the lease that the bench has now. Raises `Refused` where it has none."""
    path = _path(bench)
    return f"{path}/{segment(call(client, 'GET', f'{path}/now', LEASE)['id'])}"


def _demand(
    context: typer.Context,
    server: str | None,
    bench: str | None,
    key: str | None,
    no_wait: bool,
    as_json: bool,
    body: dict[str, Any],
) -> int:
    """Make a demand and wait for its outcome; exit code 0 where it was done, 1 where not."""
    with connect(context.obj, server, drive=False) as client:
        path = f"{_lease_path(client, bench_of(client, context.obj, bench))}/demands"
        made = call(client, "POST", path, DEMAND, json=body, headers={"Idempotency-Key": key_or_new(key)})
        while not made["over"] and not no_wait:
            pause(LOOK_S)
            made = answer(client, "GET", f"{path}/{segment(made['key'])}").json()
    _say(made, as_json, f"{made['kind']}: {made['state']}{': ' if made['text'] else ''}{made['text']}")
    return 0 if made["state"] in ("done", "accepted", "doing") else 1


def _say(document: dict[str, Any], as_json: bool, text: str) -> None:
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        console.print(text, soft_wrap=True)
