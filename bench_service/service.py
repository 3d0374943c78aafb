"""One service of a process: the services of each noun, and its life from registration to its end."""

import logging
from collections.abc import Callable
from functools import partial

from bench_service.access.book import AccessBook
from bench_service.access.service import AccessService
from bench_service.bench.driver import BenchDriver
from bench_service.bench.live.values import LiveBoard
from bench_service.bench.make_safe import Rescue
from bench_service.bench.processes import ProcessIdentity
from bench_service.bench.safety import SafetyService
from bench_service.bench.stop.routes import StopRoutes
from bench_service.campaigns.service import CampaignService
from bench_service.campaigns.stores import Stores
from bench_service.evidence.analyses import AnalysisService
from bench_service.evidence.batches.runner import RunnerMaker
from bench_service.evidence.batches.service import BatchService
from bench_service.evidence.imports import ImportService, SyntheticRates
from bench_service.evidence.raw_data.nightly import NightlyStorage
from bench_service.evidence.raw_data.service import RawDataService, StorageSettings
from bench_service.evidence.recomputation import RecomputationService
from bench_service.evidence.reports.service import ReportService
from bench_service.evidence.so_far.service import EstimateService
from bench_service.evidence.units import register
from bench_service.evidence.upkeep import NightlyScrub, UpkeepService
from bench_service.evidence.work_processes import WorkApart
from bench_service.jobs.history import is_empty, missing_history
from bench_service.jobs.manual.presence import Presence
from bench_service.jobs.manual.service import ManualService
from bench_service.jobs.planning import Planner
from bench_service.jobs.queue_service import QueueService
from bench_service.jobs.service import JobService
from bench_service.jobs.stops import StopService
from bench_service.jobs.worker import Worker
from bench_service.model.errors import NotDriving, NotReady
from bench_service.model.records import reasons_of
from bench_service.settings import Settings
from bench_service.telemetry.tracing import Traces
from bench_service.telemetry.upkeep import DatabasePort, NoDatabase

log = logging.getLogger(__name__)
LEAST_FREE_BYTES = 200_000_000
"""Free bytes on the database's disk below which the service is not ready: an hour of samples is about 17 MB."""


class BenchService:
    """All services of one process by noun (jobs, campaigns, evidence, access, …), for HTTP, pages and command line, and
    their life.
    """

    def __init__(
        self,
        stores: Stores,
        driver: BenchDriver | None,
        planner: Planner,
        worker: Worker | None,
        code_version: str,
        safety: SafetyService,
        live: LiveBoard | None = None,
        free_bytes: Callable[[], int | None] = lambda: None,
        traces: Traces | None = None,
        stop_routes: StopRoutes | None = None,
        rescued: Rescue | None = None,
        processes: WorkApart | None = None,
        database: DatabasePort | None = None,
        settings: Settings | None = None,
        runner: RunnerMaker | None = None,
        synthetic: SyntheticRates | None = None,
    ) -> None:
        """Set up with `driver` of this process's own bench; None: it plans and queues for benches that workers drive.

        `free_bytes`: room on the database's disk, where that is known. `stop_routes`: routes by which a stop reaches
        its bench; None: through the database alone. `rescued`: the result of making devices safe at start. `processes`:
        where analyses are computed and reports typeset; None: in the caller's thread. `database`: the database as a
        whole; None: not known. `settings`: the time of the nightly work, and the rules for raw data; None: no such
        work, and no rules. `runner`: builds the runner of batches of analyses; None: other processes run their tasks.
        `synthetic`: the source of synthetic recordings; None: they are refused.
        """
        self.access = AccessService(stores.access, AccessBook(stores.access))
        self.safety = safety
        self.traces = traces or Traces()
        self.live = live or LiveBoard(stores.live)
        self.stores = stores
        self.planner = planner
        self.catalogue = planner.catalogue
        self.code_version = code_version
        self.benches = planner.benches
        self.imports = ImportService(stores, synthetic)
        self.analyses = AnalysisService(
            stores, planner.catalogue, stores.jobs.get, code_version, processes and processes.analyses
        )
        self.recomputations = RecomputationService(
            stores, planner.catalogue, stores.jobs.get, code_version, processes and processes.analyses
        )
        self.reports = ReportService(stores, planner.catalogue, stores.jobs.get, processes and processes.printing)
        self.estimates = EstimateService(partial(_estimates, stores), stores.jobs.get, processes and processes.analyses)
        self._runner = None if runner is None else runner(stores.batches, self.analyses)
        self.batches = BatchService(stores, planner.catalogue, self._runner.wake if self._runner else lambda: None)
        self.queues = QueueService(stores, planner.benches, self._wake)
        self.jobs = JobService(stores, planner, self.queues, driver, worker, code_version, self._wake)
        self.manual = ManualService(stores, planner.benches, self.queues, self._wake)
        self._presence = Presence(stores.manual)
        self._stop_routes = stop_routes or StopRoutes(None)
        self.stops = StopService(stores, planner.benches, safety, self._wake, self._stop_routes, stores.audit)
        self.campaigns = CampaignService(stores, planner, self.analyses, self.jobs.submit, self.jobs.cancel)
        self._driver = driver
        self._worker = worker
        self._free_bytes = free_bytes
        self._rescued = rescued
        self.upkeep = UpkeepService(stores, database or NoDatabase(), f"the service, {ProcessIdentity.own()}")
        self._missing = ""
        """The sentence on a history that the devices remember and the database does not; empty: there is none."""
        rules = settings or Settings.model_validate({"scrub_at": ""})
        kept = StorageSettings(rules.raw_days, rules.archive_days, rules.archive)
        self.raw_data = RawDataService(stores, database or NoDatabase(), kept, stores.raw_data.archive_at)
        nightly = NightlyStorage(self.raw_data, stores, f"the service, {ProcessIdentity.own()}")
        self._nightly = NightlyScrub(self.upkeep, rules.scrub_at, nightly.run)

    def register(self) -> None:
        """Store the description of the own bench and its units, and remove orphaned imports. Raises
        `StorageFailure`.
        """
        self.imports.discard_crashed()
        if self._driver is None:
            return
        mounted = self._driver.mounted()
        for unit in mounted:
            register(self.stores.units, unit)
        self.stores.benches.put_bench(self._driver.description, [unit.serial for unit in mounted])
        if self._worker is not None:
            self._missing = missing_history(self.safety.known(self._driver.description.id).devices, self.stores.jobs)
            if self._missing:
                log.warning("bench %s: %s", self._driver.description.id, self._missing)
            self.safety.at_start(self._driver.description.id, self._rescued)

    def begin(self, answers: bool = False) -> None:
        """Begin to work while the service already answers. The bench's lease must be held.

        `answers`: this process answers clients, which keeps leases of manual mode alive.
        """
        if answers:
            self._presence.begin()
        if self._runner is not None and self._runner.resumes:
            self._runner.begin()
        if self._worker is not None:
            warm_up = [lambda: self.catalogue.procedures, lambda: self.catalogue.methods]
            self._worker.begin(warm_up if self._driver is None else [self._driver.warm_up, *warm_up])
            self.campaigns.conductor.begin()
            self._nightly.begin()

    def at_failed_start(self, then: Callable[[], object]) -> None:
        """Have `then` called where the job engine does not start. To be called before `begin`."""
        if self._worker is not None:
            self._worker.at_failed_start(then)

    def failed_start(self) -> NotDriving | None:
        """Return the error of an engine that did not start; None where it runs, or may yet."""
        return None if self._worker is None else self._worker.failed_start()

    def require_start(self) -> None:
        """Wait until the job engine runs. Raises `NotDriving` where it does not start."""
        if self._worker is not None:
            self._worker.require_engine()

    def ready(self) -> tuple[str, ...]:
        """Wait until a job could start, and return notes for a person.

        A stopped bench is such a note: a person has stopped it, and the service works. Raises `NotReady` with every
        reason, `StorageFailure` where the database does not answer.
        """
        self.stores.jobs.has_any()
        reasons = list(self.upkeep.troubles())
        free = self._free_bytes()
        if free is not None and free < LEAST_FREE_BYTES:
            reasons.append(f"the disk is nearly full: {free} bytes are free, {LEAST_FREE_BYTES} are needed")
        if self._worker is not None:
            reasons += self._worker.troubles()
        if reasons:
            raise NotReady(reasons)
        standing = ((bench, self.stores.benches.standing_stops(bench)) for bench in self.benches.ids())
        stopped = (f"bench {bench} is stopped: {reasons_of(stops)}" for bench, stops in standing if stops)
        self._missing = self._missing if self._missing and is_empty(self.stores.jobs) else ""
        missing = (self._missing,) if self._missing else ()
        return (*stopped, *missing, *self.catalogue.notes(), *self.upkeep.notes())

    def stop(self) -> None:
        """End the service, and wait until the bench is safe; the running job resumes after the next start."""
        self._nightly.end()
        self._presence.end()
        self.campaigns.conductor.stop()
        if self._worker is not None:
            self._worker.shut_down()
        self.imports.close()

    def _wake(self, bench_id: str) -> None:
        """Wake the worker of a bench that may have work: this process's own, or another one on this host."""
        if self._driver is not None and self._driver.description.id == bench_id:
            if self._worker is not None:
                self._worker.wake()
        else:
            self._stop_routes.wake(bench_id)


def _estimates(stores: Stores, job_id: str) -> str:
    """Work out a job's estimates here: only a command's own service does, its numerics are loaded for that alone."""
    from bench_service.evidence.so_far.estimating import Estimating

    return Estimating(stores, stores.jobs.get).text(job_id)
