"""The command ``bench worker --analyse``: run tasks of batches of analyses, in a process without HTTP and bench."""

from collections.abc import Callable
from contextlib import ExitStack

from bench_service.cli.processes.ending import ending_on_signals
from bench_service.cli.processes.logs import set_up
from bench_service.cli.processes.private_files import protect
from bench_service.persistence import open_stores
from bench_service.persistence.evidence.batch_running import runner_of
from bench_service.settings import Settings
from bench_service.telemetry.code_version import code_version

LOOK_S = 0.5
"""Interval at which the main thread looks for signals that came meanwhile [s]."""


def analyse_until_ended(settings: Settings, at_once: int, say: Callable[[str], object]) -> None:
    """Run tasks in `at_once` processes until SIGTERM or SIGINT; those under way go back into the queue.

    Raises `StorageFailure` where the database cannot be opened.
    """
    set_up(settings, "info")
    protect(settings)
    ending = ending_on_signals()
    with ExitStack() as closing:
        stores, opened = open_stores(settings.database_url, settings.copies_in())
        closing.callback(opened.dispose)
        runner = runner_of(opened, settings.database_url, stores.batches, code_version(), closing, at_once)
        runner.begin()
        say(f"analysing in {at_once} process{'es' if at_once > 1 else ''}")
        while not ending.wait(LOOK_S):  # a signal that reaches another thread does not wake this one
            continue
