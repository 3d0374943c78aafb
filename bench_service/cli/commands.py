"""The command line ``bench``: its commands by subject, and how their errors are reported.

Each command prints its outcome to standard output, and errors to standard error. Tables and progress bars are imported
by the commands that show them: a server that starts does not wait for them.
"""

import logging
from typing import Annotated

import typer

from bench_service.cli.completion import completion, prepare
from bench_service.cli.groups import (
    access,
    batches,
    benches,
    calibrations,
    campaigns,
    certificates,
    corrections,
    database,
    evidence,
    exporting,
    importing,
    jobs,
    manual,
    mountings,
    plans,
    reports,
    reservations,
    services,
    storage,
    units,
)
from bench_service.cli.groups.one_job import job
from bench_service.cli.options import errors
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
PANELS = {
    "Service and bench": (
        services.serve,
        services.demo,
        benches.worker,
        benches.supervise,
        benches.stop,
        benches.release,
        benches.queue,
        benches.check_file,
        benches.simulate,
    ),
    "Jobs": (plans.procedures, plans.preview, jobs.run, jobs.jobs),
    "Evidence": (
        evidence.recordings,
        exporting.export,
        importing.synthesise,
        plans.methods,
        evidence.analyse,
        evidence.results,
        reports.report,
        units.units,
        calibrations.calibrations,
        corrections.corrections,
    ),
    "Database": (database.database, database.scrub, database.backup, database.restore),
    "Reservations": (reservations.reservations, reservations.reserve, reservations.unreserve),
    "This program": (completion, services.openapi),
}
"""Commands by the heading under which the help lists them."""
for _panel, _commands in PANELS.items():
    for _command in _commands:
        app.command(rich_help_panel=_panel)(_command)
app.command("import", rich_help_panel="Evidence")(importing.import_)
app.add_typer(job, name="job", rich_help_panel="Jobs")
app.add_typer(calibrations.calibration, name="calibration", rich_help_panel="Evidence")
app.add_typer(corrections.correction, name="correction", rich_help_panel="Evidence")
app.add_typer(certificates.certificate, name="certificate", rich_help_panel="Evidence")
app.add_typer(batches.batches, name="batch", rich_help_panel="Evidence")
app.add_typer(mountings.mounting, name="mounting", rich_help_panel="Service and bench")
app.add_typer(manual.manual, name="manual", rich_help_panel="Service and bench")
app.add_typer(campaigns.campaigns, name="campaign", rich_help_panel="Jobs")
app.add_typer(campaigns.schedules, name="schedule", rich_help_panel="Jobs")
app.add_typer(storage.storage, name="storage", rich_help_panel="Database")
app.add_typer(access.users, name="user", rich_help_panel="Access")
app.add_typer(access.tokens, name="token", rich_help_panel="Access")
app.add_typer(access.trail, name="audit", rich_help_panel="Access")
prepare()


def _print_version(wanted: bool) -> None:
    if wanted:
        from bench_service.telemetry.code_version import code_version

        print(f"bench {code_version()}")
        raise typer.Exit


@app.callback()
def main(
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and end")
    ] = False,
) -> None:
    """Test bench for inertial navigation units. Exit code: 0 pass, 1 fail, 2 error."""


def run_command_line(settings: Settings, arguments: list[str] | None = None) -> int:
    """Run one command and return its exit code: 0 pass, 1 fail, 2 error."""
    try:
        code = app(arguments, standalone_mode=False, obj=settings, prog_name="bench")
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
    from bench_service.cli.processes.logs import set_up

    set_up(settings, "warning")
    log.debug("the command failed", exc_info=error)
    about = " ".join(str(error).split()) or "no more is known"
    what = f"unforeseen {type(error).__name__}: {about} (BENCH_LOG_LEVEL=debug shows where)"
    errors.print(f"bench: {what}", style="red", soft_wrap=True)
