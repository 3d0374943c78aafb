"""The commands of the command line. Each prints its outcome to standard output, and errors to standard error.

Tables and progress bars are imported by the commands that show them: a server that starts does not wait for them.
"""

import json
import logging
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import typer

from bench_service.cli import bench_commands, campaign_commands
from bench_service.cli.client import RESULT, call, check, connect, segment
from bench_service.cli.files import check_folder, text_of, whole_file
from bench_service.cli.options import AsJson, Server, announce, console, errors, parameter, wide
from bench_service.cli.refusal import Refused
from bench_service.model.errors import ServiceError
from bench_service.settings import Settings

log = logging.getLogger(__name__)
HELP = "Test bench for inertial navigation units. Exit code: 0 pass, 1 fail, 2 error."
app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help=HELP,
)
app.add_typer(campaign_commands.campaigns, name="campaign")
app.add_typer(campaign_commands.schedules, name="schedule")


def run_command_line(settings: Settings, arguments: list[str] | None = None) -> int:
    """Run one command and return its exit code: 0 pass, 1 fail, 2 error."""
    try:
        code = app(arguments, standalone_mode=False, obj=settings)
    except (Refused, ServiceError) as error:
        errors.print(f"bench: {error}", style="red", soft_wrap=True)
        return 2
    except typer.Abort:
        return 2
    except SystemExit as ended:  # the output was closed, or no server could start; 1 would be a verdict
        return 2 if ended.code else 0
    except Exception as error:
        if hasattr(error, "show") and hasattr(error, "exit_code"):  # a usage error of the command line itself
            error.show()  # pyright: ignore[reportAttributeAccessIssue]
            return 2
        _unforeseen(settings, error)
        return 2
    return int(code or 0)


def _unforeseen(settings: Settings, error: Exception) -> None:
    """Report an unexpected exception in one sentence; its traceback goes to the log."""
    from bench_service.cli.logs import set_up

    set_up(settings, "warning")
    log.debug("the command failed", exc_info=error)
    about = " ".join(str(error).split()) or "no more is known"
    what = f"unforeseen {type(error).__name__}: {about} (BENCH_LOG_LEVEL=debug shows where)"
    errors.print(f"bench: {what}", style="red", soft_wrap=True)


@app.command()
def serve(
    context: typer.Context,
    host: Annotated[str | None, typer.Option(help="Address to listen on")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on")] = None,
    no_worker: Annotated[bool, typer.Option("--no-worker", help="Drive no bench: workers of the database do")] = False,
    bench_file: bench_commands.BenchFileOption = None,
) -> None:
    """Serve the API and the pages, and run jobs on the bench, until interrupted."""
    from bench_service.cli.companion import accompanied
    from bench_service.cli.serving import check_port, ready

    settings = bench_commands.of_bench(_with(context.obj, host=host, port=port), None, bench_file)
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


for _command in (bench_commands.worker, bench_commands.supervise, bench_commands.stop, bench_commands.simulate):
    app.command()(_command)
app.command("check-file")(bench_commands.check_file)


@app.command()
def demo(
    context: typer.Context,
    port: Annotated[int | None, typer.Option(help="Port to listen on")] = None,
    once: Annotated[bool, typer.Option(help="End after the verdict, with it as exit code")] = False,
    unit: Annotated[str, typer.Option(help="Serial of a simulated unit, SIM-0001 or RANDOM-<number>")] = "SIM-0001",
    seed: Annotated[int, typer.Option(help="Seed of the calibration's world; the verification takes the next")] = 2,
) -> int:
    """Start the service, calibrate and verify the simulated unit through it, show what came out, keep serving."""
    from bench_service.cli.companion import accompanied
    from bench_service.cli.demo import demonstrate
    from bench_service.cli.serving import check_port, serving

    settings = _with(context.obj, port=port)
    check_port(settings)
    address = f"http://{settings.host}:{settings.port}"
    with (
        serving(settings),
        accompanied(settings, lambda: True),
        connect(settings, address, drive=False) as client,
    ):
        console.print(f"bench {settings.bench_id} at {address}")
        code = demonstrate(client, unit, seed, console)
        if not once:
            console.print(f"serving on {address} (API: {address}/docs); Ctrl-C ends", soft_wrap=True)
            _until_interrupted()
    return code


@app.command()
def run(
    context: typer.Context,
    procedure: str,
    unit: Annotated[str, typer.Option(help="Serial of the unit")],
    set_: Annotated[list[str], typer.Option("--set", help="A parameter, name=JSON value; may be repeated")] = [],  # noqa: B006
    seed: Annotated[int | None, typer.Option(help="Seed of a simulated bench")] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Run a procedure on a unit and wait for its verdict."""
    from bench_service.cli.tables import check_table, show_warnings
    from bench_service.cli.watching import JOB, exit_code, watch

    body = {"procedure": procedure, "unit": unit, "parameters": dict(map(parameter, set_)), "seed": seed}
    with connect(context.obj, server, drive=True) as client:
        job = watch(client, call(client, "POST", "/api/v1/jobs", JOB, json=body), errors)
        result = call(client, "GET", f"/api/v1/jobs/{job['id']}/result", RESULT) if job["result"] else None
    if as_json:
        print(json.dumps({"job": job, "result": result}, indent=2))
    elif result is None:
        raise Refused(f"job {job['id']} {job['state']}: {(job['error'] or {}).get('message', 'no reason given')}")
    else:
        console.print(check_table(result["document"]))
        show_warnings(result["document"], console)
        console.print(f"verdict {job['verdict']}, job {job['id']}", soft_wrap=True)
    return exit_code(job["verdict"])


@app.command("import")
def import_(
    context: typer.Context,
    files: Annotated[list[Path], typer.Argument(exists=True, dir_okay=False)],
    description: Annotated[Path, typer.Option(exists=True, dir_okay=False, help="JSON file that says what is in them")],
    server: Server = None,
) -> None:
    """Import a recorded file, or several that are columns of one recording."""
    data = {"description": text_of(description)}
    with connect(context.obj, server, drive=False) as client, ExitStack() as closing:
        opened = [(path.name, closing.enter_context(path.open("rb"))) for path in files]
        parts = [("files", (name, file, "application/octet-stream")) for name, file in opened]
        recording = call(client, "POST", "/api/v1/recordings", ("id", "warnings"), files=parts, data=data)
    console.print_json(json.dumps(recording))
    for warning in recording["warnings"]:
        errors.print(f"warning: {warning}", soft_wrap=True)


@app.command()
def analyse(
    context: typer.Context,
    method: str,
    recording: Annotated[list[str], typer.Option(help="Id of a recording; may be repeated")] = [],  # noqa: B006
    calibration: Annotated[list[str], typer.Option(help="Id of a calibration; may be repeated")] = [],  # noqa: B006
    set_: Annotated[list[str], typer.Option("--set", help="A parameter, name=JSON value; may be repeated")] = [],  # noqa: B006
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Run a method on stored recordings or calibrations; prints its coefficients, checks and verdict."""
    from bench_service.cli.report_tables import report_tables
    from bench_service.cli.tables import check_table, show_warnings
    from bench_service.cli.watching import exit_code

    body = {
        "method": method,
        "recordings": recording,
        "calibrations": calibration,
        "parameters": dict(map(parameter, set_)),
    }
    with connect(context.obj, server, drive=False) as client:
        result = call(client, "POST", "/api/v1/analyses", RESULT, json=body)
    if as_json:
        print(json.dumps(result, indent=2))
    else:
        for table in report_tables(method, result["document"]):
            console.print(table)
        console.print(check_table(result["document"]))
        show_warnings(result["document"], console)
        console.print(f"verdict {result['verdict']}, result {result['id']}", soft_wrap=True)
    return exit_code(result["verdict"])


@app.command()
def export(
    context: typer.Context,
    recording: str,
    output: Annotated[
        Path, typer.Option("--output", "-o", dir_okay=False, help="File to write; its ending is the format")
    ],
    channels: Annotated[str | None, typer.Option(help="Names, separated by commas; all without it")] = None,
    start_s: Annotated[float | None, typer.Option(help="From this second of the recording")] = None,
    stop_s: Annotated[float | None, typer.Option(help="Up to this second of the recording")] = None,
    server: Server = None,
) -> None:
    """Take a recording's samples out as .csv, .parquet or .arrow."""
    options: dict[str, Any] = {"channels": channels, "start_s": start_s, "stop_s": stop_s}
    query = {"format": output.suffix.removeprefix("."), **{k: v for k, v in options.items() if v is not None}}
    check_folder(output)
    with (
        connect(context.obj, server, drive=False) as client,
        client.stream("GET", f"/api/v1/recordings/{segment(recording)}/data", params=query) as response,
    ):
        check(response)
        with whole_file(output) as sink:
            for piece in response.iter_bytes():
                sink.write(piece)
    console.print(f"{output}: {output.stat().st_size} bytes")


@app.command()
def jobs(
    context: typer.Context,
    state: Annotated[str | None, typer.Option(help="Only jobs in this state")] = None,
    unit: Annotated[str | None, typer.Option(help="Only jobs of this unit")] = None,
    limit: Annotated[int, typer.Option(help="How many")] = 20,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """List jobs, newest first."""
    from bench_service.cli.tables import job_table

    query = {k: v for k, v in {"state": state, "unit": unit, "limit": limit}.items() if v is not None}
    with connect(context.obj, server, drive=False) as client:
        page = call(client, "GET", "/api/v1/jobs", ("items",), params=query)
    if as_json:
        print(json.dumps(page, indent=2))
    else:
        wide().print(job_table(page["items"]))


def _with(settings: Settings, **given: Any) -> Settings:
    return settings.model_copy(update={name: value for name, value in given.items() if value is not None})


def _until_interrupted() -> None:
    import threading

    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        print(file=sys.stderr)
