"""Composition of a process that drives a bench: its lease, its worker, manual mode, and the guard that stops both."""

from contextlib import ExitStack
from functools import partial

from bench_service.bench.driver import BenchDriver
from bench_service.bench.live.values import Heartbeat, LiveBoard
from bench_service.bench.processes import Watch
from bench_service.bench.worker_time_limits import ending_s
from bench_service.bench_files import BenchFiles
from bench_service.campaigns.stores import Stores
from bench_service.collector import no_collection
from bench_service.drivers.composition import longest_safe_s
from bench_service.evidence.spread_processes import spread_processes
from bench_service.jobs.dispatcher import Dispatcher, JobEngine
from bench_service.jobs.instrumented_runner import InstrumentedRunner
from bench_service.jobs.manual.runner import ManualRunner
from bench_service.jobs.planning import Planner
from bench_service.jobs.runner import JobRunner
from bench_service.jobs.worker import Worker
from bench_service.notifications.opening import begin_notifier
from bench_service.persistence import BenchLease, Database, acquire_lease, engine_database
from bench_service.persistence.database import as_storage_error
from bench_service.service import LEAST_FREE_BYTES
from bench_service.settings import Settings
from bench_service.telemetry.tracing import Traces


def driving(
    settings: Settings,
    opened: Database,
    stores: Stores,
    planner: Planner,
    driver: BenchDriver,
    code: str,
    traces: Traces,
    files: BenchFiles,
    closing: ExitStack,
) -> tuple[Worker, LiveBoard]:
    """Return the worker and the live state of this process's bench, after its lease was taken and its heartbeat and
    stop guard were set up. Raises `BenchBusy`.
    """
    lease = acquire_lease(settings.database_url, settings.bench_id)
    closing.callback(lease.release)
    files.begin_driving()
    closing.callback(files.host.end_driving)
    board = LiveBoard(stores.live, settings.bench_id)
    heartbeat = Heartbeat(board, stores.live)
    heartbeat.begin()
    closing.callback(heartbeat.end)
    spread = spread_processes(closing)
    runner = InstrumentedRunner(
        stores, planner, driver, code, lease.held, board, settings.retry_scale, traces, files.stopped, spread
    )
    patience_s = ending_s(longest_safe_s(settings))
    manual = ManualRunner(stores, stores.audit, driver, board, files.stopped, patience_s)
    worker = Worker(
        runner, partial(_engine, settings, patience_s), partial(_dispatcher, settings, stores, lease, files, manual)
    )
    guard = files.guard(partial(_stop_now, runner, manual, files.host), worker.wake)
    guard.begin()
    closing.callback(guard.end)
    closing.callback(files.keep_books(stores).end)
    begin_notifier(settings, stores, opened.free_bytes, LEAST_FREE_BYTES, files.host, closing)
    return worker, board


def _engine(settings: Settings, patience_s: float, runner: JobRunner) -> JobEngine:
    """Make the job engine, imported here because that takes as long as the rest of the service."""
    with no_collection():
        from bench_service.jobs.engine import Engine

    books = engine_database(settings.database_url, settings.bench_id)
    return Engine(*books, settings.bench_id, runner, as_storage_error, patience_s)


def _dispatcher(
    settings: Settings,
    stores: Stores,
    lease: BenchLease,
    files: BenchFiles,
    manual: ManualRunner,
    runner: JobRunner,
    engine: JobEngine,
) -> Dispatcher:
    return Dispatcher(settings.bench_id, stores, runner, engine, lease, settings.poll_s, files.stopped, manual)


def _stop_now(jobs: JobRunner, manual: ManualRunner, watch: Watch) -> None:
    """Leave whatever drives the bench, and make the bench safe.

    Called by the stop guard, again and again while a stop stands and the bench is not safe.
    """
    manual.stop_now()
    jobs.stop_now()
    if watch.supervisor() is None:
        jobs.make_safe_again()
