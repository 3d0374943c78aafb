"""The command ``bench simulate``: serves the devices of a bench file as simulators, until SIGTERM or SIGINT."""

import asyncio
from collections.abc import Callable
from pathlib import Path

from bench_service.cli.processes.ending import ending_on_signals
from bench_service.drivers.bench_file.document import read_bench_file
from bench_service.drivers.served import serve, served_bench

LOOK_S = 0.1


def simulate(path: Path, faults: Path | None, say: Callable[[str], object]) -> None:
    """Serve the devices of a bench file as simulators, and block until a signal ends it. Raises `Misconfigured`."""
    bench = served_bench(read_bench_file(path), faults)
    ending = ending_on_signals()
    asyncio.run(serve(bench, ending.is_set, say, LOOK_S))
