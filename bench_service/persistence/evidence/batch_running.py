"""Construction of the runner of batches: its processes, which give way to everything else, and its name."""

import os
from contextlib import ExitStack, suppress
from typing import Any

from bench_service.evidence.analyses import AnalysisRequest, AnalysisService
from bench_service.evidence.batches.runner import BatchRunner, RunnerMaker
from bench_service.evidence.batches.store import BatchStore
from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.work_processes import Run, WorkProcesses
from bench_service.persistence.database import Database
from bench_service.persistence.evidence.worker_names import SqlWorkerNames

NICENESS = 19
"""Niceness of these processes: on a host that drives a bench too they have what is left."""
TAKEN, COMPUTED = "taken ", "computed "
"""Words before the id of a result on its way from a process."""


def cores_left() -> int:
    """Return the number of analysis processes on a machine that also drives a bench: all cores but one, at least
    one.
    """
    return max(1, len(os.sched_getaffinity(0)) - 1)


def open_batch_run(database_url: str, code_version: str) -> Run:
    """Return the function that a process for tasks of batches runs, see `WorkProcesses`: its one verb is
    `run_or_take`.
    """
    from threadpoolctl import threadpool_limits

    from bench_service.persistence.stores import open_stores

    with suppress(OSError):
        os.nice(NICENESS)
    stores, _ = open_stores(database_url)  # it is closed with the process
    service = AnalysisService(stores, Catalogue(), stores.jobs.get, code_version)
    threadpool_limits(1)

    def run(_verb: str, arguments: tuple[Any, ...]) -> str:
        result, taken = service.run_or_take(*arguments)
        return f"{TAKEN if taken else COMPUTED}{result.id}"

    return run


def runner_of(
    database: Database, database_url: str, batches: BatchStore, code_version: str, closing: ExitStack, at_once: int
) -> BatchRunner:
    """Build a runner with `at_once` processes, begun with its first task; `closing` ends both."""
    processes = WorkProcesses(open_batch_run, database_url, code_version, at_once=at_once, waiting=at_once)

    def compute(request: AnalysisRequest) -> tuple[str, bool]:
        word, _, result = processes.result("run", request).partition(" ")
        return result, f"{word} " == TAKEN

    names = SqlWorkerNames(database, database_url)
    runner = BatchRunner(batches, names, compute, at_once, rest=processes.close)
    closing.callback(processes.close)
    closing.callback(runner.end)
    return runner


def runner_here(
    database: Database, database_url: str, batches: BatchStore, analyses: AnalysisService, closing: ExitStack
) -> BatchRunner:
    """Build a runner that computes in a thread of this process, for a command that works without a server."""

    def compute(request: AnalysisRequest) -> tuple[str, bool]:
        result, taken = analyses.run_or_take(request)
        return result.id, taken

    runner = BatchRunner(batches, SqlWorkerNames(database, database_url), compute, 1, resumes=False)
    closing.callback(runner.end)
    return runner


def runner_maker(
    database: Database, database_url: str, code_version: str, closing: ExitStack, apart: bool
) -> RunnerMaker | None:
    """Return the function that builds the runner of a service; None on Postgres, where workers run the tasks (`bench
    worker --analyse`). `apart`: tasks run in processes of their own; False: in a thread of this one.
    """
    if database.is_postgres:
        return None
    if apart:
        return lambda batches, _: runner_of(database, database_url, batches, code_version, closing, cores_left())
    return lambda batches, analyses: runner_here(database, database_url, batches, analyses, closing)
