"""Entry point of a drawing process: it loads matplotlib, and nothing of the service."""

from typing import Any

from bench_service.evidence.work_processes import Run
from bench_service.formats.printed.drawing import drawn_here
from bench_service.pages import figures


def open_drawing() -> Run:
    """Return the function that a drawing process runs, see `WorkProcesses`: it takes a figure and returns its SVG
    document.
    """
    drawn_here(figures.SMALLEST)  # load matplotlib before the first one is waited for

    def run(_: str, arguments: tuple[Any, ...]) -> str:
        return drawn_here(*arguments)

    return run
