"""Figures of pages as SVG: drawn by `formats.printed.drawing`, in another process where there is one, and kept."""

import logging
from functools import lru_cache

from bench_service.evidence.work_processes import WorkProcesses
from bench_service.formats.printed.drawing import drawn_here
from bench_service.model.errors import Overloaded, StorageFailure
from procedures.core.report import Figure, Series

log = logging.getLogger(__name__)
SMALLEST = Figure("", "", "", (Series("", (0.0, 1.0), (0.0, 1.0)),))
_elsewhere: list[WorkProcesses] = []
"""The processes that draw, where it is not this one."""


def begin_drawing() -> None:
    """Begin the process that draws, where there is one: a person has opened a page, and will come to a figure."""
    for processes in _elsewhere:
        processes.begin()


def draw_in(processes: WorkProcesses | None) -> None:
    """Have figures drawn in these processes from now on; None: in this process."""
    _elsewhere[:] = [] if processes is None else [processes]


@lru_cache(maxsize=200)
def svg(figure: Figure) -> str:
    """Return the figure as an SVG document; drawn once, because a result never changes."""
    for processes in _elsewhere:
        try:
            return processes.result("svg", figure)
        except (Overloaded, StorageFailure) as error:
            log.warning("a figure is drawn in this process: %s", error)
    return drawn_here(figure)
