"""Progress of a batch of analyses until its end, with a progress bar for a person."""

from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from bench_service.cli.asking.retries import with_retries
from bench_service.cli.options import notice
from bench_service.wall_clock import pause

OPEN = ("waiting", "running")


def follow(batch: dict[str, Any], ask: Callable[[], dict[str, Any]], console: Console, look_s: float) -> dict[str, Any]:
    """Show the counts of a batch until it has ended; return its last state. `ask` gives its present one.

    Raises `Refused` where the service is away for long.
    """
    goes_on = f"The service has batch {batch['id']} and continues it: `bench batch watch {batch['id']}` shows it"
    words = TextColumn("{task.description}", markup=False)
    with Progress(words, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), console=console) as progress:
        bar = progress.add_task(f"batch {batch['id']}", total=batch["total"])
        while True:
            counts = batch["counts"]
            progress.update(bar, completed=batch["total"] - sum(counts[state] for state in OPEN))
            if batch["ended_at"] is not None:
                return batch
            pause(look_s)
            batch = with_retries(ask, notice, goes_on)
