"""The composition root, the only place where stores, driver, engine and HTTP meet."""

from collections.abc import AsyncGenerator, Callable
from contextlib import ExitStack, asynccontextmanager
from datetime import timedelta
from functools import partial
from importlib.metadata import version

from anyio import CapacityLimiter
from fastapi import Depends, FastAPI
from starlette.concurrency import run_in_threadpool
from threadpoolctl import threadpool_limits

from bench_service.api import audit, health, metrics
from bench_service.api.access import guard, identify
from bench_service.api.http import bodies, door, endings, errors, headers, late_routes, queries, request_id, transfer
from bench_service.bench.devices import BenchDevices
from bench_service.bench.directory import BenchDirectory
from bench_service.bench.live.values import LiveBoard
from bench_service.bench.prompts import AskedOperator
from bench_service.bench.safety import SafetyService
from bench_service.bench.stop.other_hosts import StopAddresses
from bench_service.bench.stop.routes import StopRoutes
from bench_service.bench_files import BenchFiles
from bench_service.collector import no_collection
from bench_service.drivers.composition import devices_of, driver_of, own_devices
from bench_service.drivers.simulated import drawn_unit, synthetic_rates
from bench_service.driving import driving
from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.reports.printing_process import open_printing
from bench_service.evidence.work_processes import WorkApart, WorkProcesses
from bench_service.jobs.planning import Planner
from bench_service.pages import figures
from bench_service.pages.drawing_process import open_drawing
from bench_service.pages.errors import ErrorPages
from bench_service.persistence import Database, lease_holder, open_stores
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.persistence.bench.stop_addresses import SqlStopAddresses
from bench_service.persistence.evidence.analysis_run import open_run
from bench_service.persistence.evidence.batch_running import runner_maker
from bench_service.persistence.upkeep.contents import DatabaseContents
from bench_service.service import BenchService
from bench_service.settings import Settings
from bench_service.telemetry.audit_retention import begin_retention
from bench_service.telemetry.code_version import code_version
from bench_service.telemetry.tracing import traces_to
from procedures.importing import IMPORTING

IMPORT_THREADS = 4
"""Maximum number of imports that are stored or wait for a reader at one time; more wait without a thread."""
DRAWINGS = 30
"""Maximum number of figures that are drawn or wait at one time."""


def open_service(settings: Settings, closing: ExitStack, drive: bool = True, apart: bool = False) -> BenchService:
    """Open a service that is ready to begin; `closing` undoes everything in reverse order.

    With `drive` it holds the bench's lease and runs jobs; without, it plans, queues, reads and analyses for benches
    that other processes drive. With `apart` analyses and drawings are made in processes of their own.
    Raises `BenchBusy`, `StorageFailure`, `NotMounted`.
    """
    files = BenchFiles(settings)
    rescued = files.rescue() if drive else None
    threadpool_limits(1)  # the matrices have at most 72 rows: BLAS threads would only spin against the bench's own
    stores, opened = open_stores(settings.database_url, settings.copies_in())
    closing.callback(opened.dispose)
    driver = driver_of(settings, partial(AskedOperator, stores.prompts)) if drive else None
    holder = partial(lease_holder, opened, settings.database_url)
    planner = Planner(
        stores.units,
        BenchDirectory(stores.benches, stores.units, driver, settings.bench_id, drawn_unit, holder),
        Catalogue(),
        stores.mountings,
    )
    code = code_version()
    traces = traces_to(settings.traces_url, settings.bench_id, code)
    closing.callback(traces.close)
    worker, board = None, LiveBoard(stores.live)
    if driver is not None:
        worker, board = driving(settings, opened, stores, planner, driver, code, traces, files, closing)
    safety = SafetyService(
        stores.benches, partial(_devices, settings), partial(HostFiles, settings.devices_in()), stores.jobs.note
    )
    stop_routes = _stop_routes(settings, opened, closing)
    processes = _work_apart(settings, code, closing) if apart else None
    service = BenchService(
        stores,
        driver,
        planner,
        worker,
        code,
        safety,
        live=board,
        free_bytes=opened.free_bytes,
        traces=traces,
        stop_routes=stop_routes,
        rescued=rescued,
        processes=processes,
        database=DatabaseContents(opened),
        settings=settings,
        runner=runner_maker(opened, settings.database_url, code, closing, apart),
        synthetic=synthetic_rates,
    )
    if settings.audit_days is not None:
        begin_retention(stores.audit, timedelta(days=settings.audit_days), closing)
    service.access.book.begin()
    closing.callback(service.access.book.end)
    closing.callback(service.stop)
    service.register()
    return service


def _stop_routes(settings: Settings, opened: Database, closing: ExitStack) -> StopRoutes:
    """The ways of a stop to the benches of this host and of others."""
    addresses = StopAddresses(SqlStopAddresses(opened).all, settings.stop_secret_in())
    addresses.begin()
    closing.callback(addresses.end)
    return StopRoutes(settings.devices_in(), addresses.route, addresses.host)


def _work_apart(settings: Settings, code: str, closing: ExitStack) -> WorkApart:
    """Processes for analyses and for printing; figures are drawn in another one from now on."""
    processes = WorkProcesses(open_run, settings.database_url, code)
    drawing = WorkProcesses(open_drawing, at_once=1, waiting=DRAWINGS)
    printing = WorkProcesses(open_printing, at_once=1)
    figures.draw_in(drawing)
    for undo in (processes.close, drawing.close, printing.close, partial(figures.draw_in, None)):
        closing.callback(undo)
    return WorkApart(processes, printing)


def _devices(settings: Settings, bench_id: str) -> BenchDevices:
    """A bench's devices on this host, without driving them; of this process's own bench by its bench file."""
    return own_devices(settings) if bench_id == settings.bench_id else devices_of(settings.devices_in(), bench_id)


def create_app(
    service: BenchService,
    max_import_bytes: int,
    at_end: Callable[[], None],
    rules: door.Door,
    proxies: identify.Proxies,
    late: late_routes.LateRoutes,
) -> FastAPI:
    """Return the FastAPI application around a service that is open; `at_end` is called when the server shuts down.

    `max_import_bytes`: size from which the files of an import are refused. `rules`: decide which requests are let in.
    `proxies`: the reverse proxies that are trusted to authenticate people. `late`: loads all routes but those of
    health, from the moment at which the server answers.
    """

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncGenerator[None]:
        late.begin(partial(_add_nouns, app, service))
        service.begin(answers=True)
        try:
            yield
        finally:
            await run_in_threadpool(at_end)

    app = FastAPI(
        title="Bench",
        summary="Test bench for inertial navigation units",
        version=version("bench-service"),
        lifespan=lifespan,
        generate_unique_id_function=lambda route: route.name,
        dependencies=[Depends(guard.authorised), Depends(queries.only_known_names), Depends(bodies.only_plain_json)],
        openapi_url=None,  # a route of our own has the document, so that its right is asked for as of every other
        docs_url=None,  # the framework's own pages load scripts from another host
        redoc_url=None,
    )
    app.state.service = service
    app.state.max_import_bytes = max_import_bytes
    app.state.import_threads = CapacityLimiter(IMPORT_THREADS)
    health.router.add_to(app.router)
    app.add_middleware(late_routes.WaitForRoutes, late=late)
    app.add_middleware(guard.Guarded, access=service.access)
    transfer.install(app)
    app.add_middleware(bodies.Bounded)
    errors.install(app)
    endings.install(app)
    app.add_middleware(identify.Identified, rules=identify.Identification(rules, service.access.book, proxies))
    app.add_middleware(door.Doorkeeper, door=rules)
    metrics.install(app, service)
    app.add_middleware(audit.Audited, trail=service.stores.audit)
    app.add_middleware(ErrorPages)
    app.add_middleware(headers.SecurityHeaders)
    app.add_middleware(request_id.RequestId)
    service.traces.instrument(app)
    return app


def _add_nouns(app: FastAPI, service: BenchService) -> None:
    """Add all other routes; they are imported here because that takes as long as all of the start before."""
    with IMPORTING, no_collection():
        from bench_service.nouns import add_nouns

        add_nouns(app, service)
