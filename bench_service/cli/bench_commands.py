"""The commands of a bench's own host: drive it, watch over it, stop it."""

from pathlib import Path
from typing import Annotated

import typer
from pydantic import ValidationError

from bench_service.cli.options import announce, console
from bench_service.cli.refusal import Refused
from bench_service.settings import Settings

BenchFileOption = Annotated[
    Path | None, typer.Option("--bench-file", dir_okay=False, help="Bench file of the bench; else that of the settings")
]


def worker(
    context: typer.Context,
    bench: Annotated[str | None, typer.Option(help="The bench; else that of the settings")] = None,
    bench_file: BenchFileOption = None,
) -> None:
    """Run the jobs of a bench, without HTTP, until SIGTERM or SIGINT. Its running job is left for the next start."""
    from bench_service.cli.working import work

    settings = of_bench(context.obj, bench, bench_file)
    work(settings, announce)


def supervise(
    context: typer.Context,
    bench: Annotated[str | None, typer.Option(help="The bench; else that of the settings")] = None,
    companion: Annotated[bool, typer.Option(help="End with the process that drives the bench")] = False,
    bench_file: BenchFileOption = None,
) -> int:
    """Watch a bench on its own host, and make it safe where the process that drives it is gone or hangs.

    Exit code 3: a companion left the bench to another supervisor.
    """
    from bench_service.cli.supervising import supervise as watch_over

    settings = of_bench(context.obj, bench, bench_file)
    return watch_over(settings, companion, announce)


def stop(
    context: typer.Context,
    bench: Annotated[str | None, typer.Option(help="The bench; else that of the settings")] = None,
    reason: Annotated[str, typer.Option(help="Why, for whoever releases it")] = "stopped by an operator",
    wait: Annotated[float, typer.Option(help="How long to wait until it is safe [s]")] = 15.0,
) -> int:
    """Stop a bench on its own host, also without API, database and free disk. Not the hardware emergency stop.

    Exit code: 0 safe, 1 asked for and not safe in time, 2 not asked for.
    """
    from bench_service.cli.stopping import stop_here

    settings = of_bench(context.obj, bench)
    return stop_here(settings.bench_id, settings.devices_in(), reason, wait, announce)


def check_file(
    context: typer.Context,
    bench_file: Annotated[Path, typer.Argument(dir_okay=False, help="The bench file")],
    ask: Annotated[bool, typer.Option("--connect", help="Ask the devices; nothing is commanded")] = False,
) -> int:
    """Check a bench file, its units and drivers; with --connect the devices too. Exit code 1: something is refused."""
    from bench_service.cli.checking import check_bench_file

    return check_bench_file(bench_file, ask, console)


def simulate(
    bench_file: Annotated[Path, typer.Option("--bench-file", dir_okay=False, help="Bench file with the addresses")],
    faults: Annotated[Path | None, typer.Option(dir_okay=False, help="Plan of faults, tables [[fault]]")] = None,
) -> None:
    """Serve the devices of a bench file as simulators on its addresses, in the makers' bytes, until SIGTERM or SIGINT.

    One world stands behind them, at the file's [simulation] seed and time_factor. A device that the file calls
    "simulated" is not served.
    """
    from bench_service.cli.simulating import simulate as serve_simulators

    serve_simulators(bench_file, faults, announce)


def of_bench(settings: Settings, bench: str | None, bench_file: Path | None = None) -> Settings:
    """Return the settings of another bench, or of the bench of a file.

    Raises `Refused` for a name that no bench can have.
    """
    given = settings.model_dump()
    if bench_file is not None:
        given = {name: value for name, value in given.items() if name != "bench_id"} | {"bench_file": bench_file}
    if bench is not None:
        given["bench_id"] = bench
    try:
        return Settings.model_validate(given)
    except ValidationError as error:
        raise Refused(f"--bench {bench}: {error.errors()[0]['msg']}") from error
