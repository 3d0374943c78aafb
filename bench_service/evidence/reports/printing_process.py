"""Entry point of a printing process: it loads typst and matplotlib, within limits of memory and time."""

import base64
import resource
import signal
from typing import Any

from bench_service.evidence.work_processes import Run
from bench_service.formats.printed.document import PrintedDocument
from bench_service.formats.printed.typesetting import remove_orphaned_folders, typeset

MEMORY_BYTES = 2_000_000_000
"""Address space of the process: the libraries take half of it, and most of that is never touched."""
TIME_S = 60.0
"""Time for one document [s]; a process that takes longer is ended, and its request is refused."""


def open_printing() -> Run:
    """Return the function that a printing process runs, see `WorkProcesses`: it takes a document and returns its PDF in
    base64.
    """
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    most = MEMORY_BYTES if hard == resource.RLIM_INFINITY else min(hard, MEMORY_BYTES)
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    remove_orphaned_folders()

    def run(_: str, arguments: tuple[Any, ...]) -> str:
        document: PrintedDocument = arguments[0]
        signal.setitimer(signal.ITIMER_REAL, TIME_S)  # the default action ends the process, also within typst
        try:
            return base64.b64encode(typeset(document)).decode()
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    return run
