"""The command ``bench worker``: run the jobs of one bench, in a process without HTTP."""

import threading
from collections.abc import Callable
from contextlib import ExitStack

from bench_service.app import open_service
from bench_service.cli.processes.allocator import limit_allocator
from bench_service.cli.processes.companion import accompanied
from bench_service.cli.processes.ending import ending_on_signals
from bench_service.cli.processes.logs import set_up
from bench_service.cli.processes.private_files import protect
from bench_service.settings import Settings


def work(settings: Settings, say: Callable[[str], object]) -> None:
    """Drive the settings' bench, and block until SIGTERM or SIGINT; then the bench is made safe, and its job left for
    the next start.

    Raises what `open_service` raises, `BenchBusy` first of all, and `NotDriving` where the engine does not start.
    """
    set_up(settings, "info")
    protect(settings)
    limit_allocator()
    ending = ending_on_signals()
    started = threading.Event()
    with accompanied(settings, lambda: started.is_set() and not ending.is_set()), ExitStack() as closing:
        service = open_service(settings, closing)
        service.begin()
        service.require_start()
        service.ready()
        started.set()
        say(f"working for bench {settings.bench_id}")
        ending.wait()
