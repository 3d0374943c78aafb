"""``bench serve``, ``demo`` and ``openapi``: the service itself, a demonstration of it, and its document."""

import sys
import threading
from typing import Annotated, Any

import typer

from bench_service.cli.asking.client import answer, connect
from bench_service.cli.options import BenchFile, Server, announce, console, of_bench
from bench_service.collector import no_collection
from bench_service.settings import Settings


def serve(
    context: typer.Context,
    host: Annotated[str | None, typer.Option(help="Address to listen on")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on")] = None,
    no_worker: Annotated[
        bool, typer.Option("--no-worker", help="Drive no bench; workers on the same database do")
    ] = False,
    bench_file: BenchFile = None,
) -> None:
    """Serve the API and the pages, and run jobs on the bench, until interrupted."""
    with no_collection():
        from bench_service.cli.processes.companion import accompanied
        from bench_service.cli.processes.serving import check_port, ready

    settings = of_bench(_with(context.obj, host=host, port=port), None, bench_file)
    check_port(settings)
    if no_worker or not settings.drive:
        with ready(settings, drive=False, level="info") as server:
            announce(f"API without a bench of its own at http://{settings.host}:{settings.port}")
            server.run()
        return
    with (
        ready(settings, level="info") as server,
        accompanied(settings, lambda: server.started and not server.should_exit),
    ):
        announce(f"bench {settings.bench_id} at http://{settings.host}:{settings.port}")
        server.run()


def demo(
    context: typer.Context,
    port: Annotated[int | None, typer.Option(help="Port to listen on")] = None,
    once: Annotated[bool, typer.Option(help="End after the verdict, which is the exit code")] = False,
    unit: Annotated[str, typer.Option(help="Serial of a simulated unit, SIM-0001 or RANDOM-<number>")] = "SIM-0001",
    seed: Annotated[int, typer.Option(help="Seed of the calibration's world; the verification takes the next")] = 2,
) -> int:
    """Start the service, calibrate and verify the simulated unit through it, show what came out, keep serving."""
    from bench_service.cli.demo import demonstrate
    from bench_service.cli.processes.companion import accompanied
    from bench_service.cli.processes.ending import ending_like_ctrl_c
    from bench_service.cli.processes.serving import check_port, serving

    settings = _with(context.obj, port=port)
    check_port(settings)
    address = f"http://{settings.host}:{settings.port}"
    driving = threading.Event()
    with (
        ending_like_ctrl_c() as nothing_interrupts,
        accompanied(settings, driving.is_set),  # outside: the supervisor ends once the bench is safe and left
        serving(settings),
        connect(settings, address, drive=False) as client,
    ):
        driving.set()
        try:
            console.print(f"bench {settings.bench_id} at {address}")
            code = demonstrate(client, unit, seed, console)
            if once:
                console.print("the service ends here; `bench serve` has the pages of these jobs", soft_wrap=True)
            else:
                console.print(f"serving on {address} (API: {address}/docs); Ctrl-C ends", soft_wrap=True)
                _until_interrupted()
        finally:
            nothing_interrupts()
            driving.clear()
    return code


def openapi(context: typer.Context, server: Server = None) -> None:
    """Print the OpenAPI document of the service, from which clients can be generated."""
    with connect(context.obj, server, drive=False) as client:
        print(answer(client, "GET", "/openapi.json").text)


def _with(settings: Settings, **given: Any) -> Settings:
    return settings.model_copy(update={name: value for name, value in given.items() if value is not None})


def _until_interrupted() -> None:
    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        print(file=sys.stderr)
