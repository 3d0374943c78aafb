"""Commands of a bench: drive it, watch over it, stop and release it on its own host; its queue."""

import json
from argparse import ArgumentTypeError
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bench_service.cli.asking.client import answer, call, connect, segment
from bench_service.cli.options import AsJson, BenchFile, Server, announce, console, of_bench, wide
from bench_service.cli.refusal import Refused
from bench_service.settings import Settings

if TYPE_CHECKING:
    import httpx


def worker(
    context: typer.Context,
    bench: Annotated[str | None, typer.Option(help="Bench; default: the one in the settings")] = None,
    bench_file: BenchFile = None,
    analyse: Annotated[
        bool, typer.Option("--analyse", help="Drive no bench: run batches of analyses, on any machine")
    ] = False,
    at_once: Annotated[int, typer.Option(min=1, max=256, help="With --analyse: processes, one thread each")] = 1,
) -> None:
    """Run the jobs of a bench, without HTTP, until SIGTERM or SIGINT. Its running job is left for the next start."""
    if analyse:
        from bench_service.cli.processes.analysing import analyse_until_ended

        if bench is not None or bench_file is not None:
            raise Refused("--analyse: a worker that analyses drives no bench; leave --bench and --bench-file out")
        analyse_until_ended(context.obj, at_once, announce)
        return
    from bench_service.cli.processes.working import work

    settings = of_bench(context.obj, bench, bench_file)
    work(settings, announce)


def supervise(
    context: typer.Context,
    bench: Annotated[str | None, typer.Option(help="Bench; default: the one in the settings")] = None,
    companion: Annotated[bool, typer.Option(help="End with the process that drives the bench")] = False,
    bench_file: BenchFile = None,
) -> int:
    """Watch a bench on its own host, and make it safe where the process that drives it is gone or hangs.

    Exit code 3: a companion left the bench to another supervisor.
    """
    from bench_service.cli.processes.supervising import supervise as watch_over

    settings = of_bench(context.obj, bench, bench_file)
    return watch_over(settings, companion, announce)


def stop(
    context: typer.Context,
    bench: Annotated[str | None, typer.Option(help="Bench; default: the one in the settings")] = None,
    reason: Annotated[str, typer.Option(help="Reason, for the person who releases it")] = "stopped by an operator",
    wait: Annotated[str, typer.Option(help="How long to wait until it is safe [s]")] = "15",
) -> int:
    """Stop a bench on its own host, also without API, database and free disk. Not the hardware emergency stop.

    Exit code: 0 safe, 1 asked for and not safe in time, 2 not asked for.
    """
    from bench_service.cli.processes.stopping import stop_here, waiting_s

    settings = of_bench(context.obj, bench)
    try:
        wait_s = waiting_s(wait)
    except ArgumentTypeError as error:
        raise Refused(f"--wait {error}") from error
    return stop_here(settings.bench_id, settings.devices_in(), reason, wait_s, announce)


def check_file(
    bench_file: Annotated[Path, typer.Argument(dir_okay=False, help="Path of the bench file")],
    ask: Annotated[bool, typer.Option("--connect", help="Query the devices; nothing is commanded")] = False,
) -> int:
    """Check a bench file, its units and drivers; with --connect the devices too. Exit code 1: something is refused."""
    from bench_service.cli.processes.checking import check_bench_file

    return check_bench_file(bench_file, ask, console)


def queue(
    context: typer.Context,
    bench: Annotated[str | None, typer.Option(help="Bench; default: the one in the settings, or the only one")] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List the jobs that wait for a bench, in the order in which they start, and why each of them waits."""
    from bench_service.cli.printing.tables import queue_table

    with connect(context.obj, server, drive=False) as client:
        path = f"/api/v1/benches/{segment(bench_of(client, context.obj, bench))}/queue"
        found = call(client, "GET", path, ("bench", "entries"))
    if as_json:
        print(json.dumps(found, indent=2))
        return
    running = "nothing runs" if found["running"] is None else f"job {found['running']} runs"
    driver = "no process drives it" if found["driven_by"] is None else f"driven by {found['driven_by']}"
    console.print(f"bench {found['bench']}: {running}; {driver}", soft_wrap=True)
    if found["entries"]:
        wide().print(queue_table(found["entries"]))


def release(
    context: typer.Context,
    remark: Annotated[str, typer.Option(help="What was checked before the bench was released")],
    by: Annotated[str, typer.Option(help="Your name")],
    stop_id: Annotated[
        str | None, typer.Argument(metavar="[STOP]", help="Id of the stop, where there are several")
    ] = None,
    bench: Annotated[str | None, typer.Option(help="Bench; default: the one in the settings, or the only one")] = None,
    server: Server = None,
) -> None:
    """Release a stop of a bench, once the bench is known to be safe; its jobs continue when no stop stands."""
    with connect(context.obj, server, drive=False) as client:
        name = bench_of(client, context.obj, bench)
        path = f"/api/v1/benches/{segment(name)}"
        if stop_id is None:
            stop_id = _only_stop(call(client, "GET", path, ("stops",))["stops"], name)
        body = {"remark": remark, "by": by}
        done = call(client, "POST", f"{path}/stops/{segment(stop_id)}/release", ("standing",), json=body)
    standing = [f"{one['id']}: {one['reason']}" for one in done["standing"]]
    left = f"; still standing: {'; '.join(standing)}" if standing else ": the bench takes jobs again"
    console.print(f"stop {stop_id} of bench {name} is released{left}", soft_wrap=True)


def bench_of(client: "httpx.Client", settings: Settings, bench: str | None) -> str:
    """Return the id of the bench that a command is for: the given one, the only one, or that of the settings. Raises
    `Refused`.
    """
    if bench is not None:
        return bench
    known = [one["id"] for one in answer(client, "GET", "/api/v1/benches").json()]
    if len(known) == 1:
        return known[0]
    if settings.bench_id in known or not known:
        return settings.bench_id
    raise Refused(f"--bench: one of {', '.join(known)} is needed")


def _only_stop(stops: list[dict[str, Any]], bench: str) -> str:
    if len(stops) == 1:
        return stops[0]["id"]
    if not stops:
        raise Refused(f"bench {bench} is not stopped: there is nothing to release")
    named = "; ".join(f"`bench release {stop['id']} --remark … --by …` ({stop['reason']})" for stop in stops)
    raise Refused(f"bench {bench} has several stops; name the one to release: {named}")


def simulate(
    bench_file: Annotated[Path, typer.Option("--bench-file", dir_okay=False, help="Bench file with the addresses")],
    faults: Annotated[Path | None, typer.Option(dir_okay=False, help="Plan of faults, tables [[fault]]")] = None,
) -> None:
    """Serve the devices of a bench file as simulators on its addresses, in the makers' bytes, until SIGTERM or SIGINT.

    One world stands behind them, at the seed and time_factor of the file's simulation. A device that it calls
    "simulated" is not served.
    """
    from bench_service.cli.processes.simulating import simulate as serve_simulators

    serve_simulators(bench_file, faults, announce)
