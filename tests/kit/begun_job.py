"""A runner with a job that has begun, without an engine: a test acquires its stations itself."""

from collections.abc import Callable

from bench_service.bench.devices import DeviceState
from bench_service.bench.directory import BenchDirectory
from bench_service.bench.safety import SafetyService
from bench_service.campaigns.stores import Stores
from bench_service.drivers.simulated import SimulatedDriver, drawn_unit
from bench_service.evidence.catalogue import Catalogue
from bench_service.jobs.dispatcher import Unfinished
from bench_service.jobs.planning import Planner
from bench_service.jobs.queue import QueueEntry
from bench_service.jobs.runner import JobRunner
from bench_service.jobs.worker import Worker
from bench_service.model.job import Job
from bench_service.model.request import JobRequest
from bench_service.service import BenchService
from bench_service.wall_clock import now
from tests.kit.supervised_bench import Watch
from tests.service.client import FAST


class IdleEngine:
    """An engine that runs nothing: here the test takes the steps."""

    def launch(self) -> None: ...

    def run(self, job: Job) -> None: ...

    def unfinished(self, job: QueueEntry) -> Unfinished:
        return Unfinished()

    def shut_down(self) -> None: ...


class IdleDispatcher:
    """A dispatcher that claims nothing."""

    def begin(self) -> None: ...

    def wake(self) -> None: ...

    def resting_s(self) -> float:
        return 60.0

    def lease_held(self) -> bool:
        return True

    def shut_down(self) -> None: ...


def planner_of(stores: Stores, driver: SimulatedDriver) -> Planner:
    benches = BenchDirectory(stores.benches, stores.units, driver, "sim", drawn_unit, lambda _: "this process")
    return Planner(stores.units, benches, Catalogue())


class FoundSafe:
    """The devices of a driver without a register, as a start finds them that has nothing to make safe."""

    def __init__(self, driver: SimulatedDriver) -> None:
        self.driver = driver
        self.make_safe, self.compare = driver.make_safe, driver.compare

    def device_state(self) -> DeviceState:
        return self.driver.device_state() or DeviceState()


def safety_of(stores: Stores, driver: SimulatedDriver) -> SafetyService:
    devices = FoundSafe(driver) if driver._register is None else driver
    return SafetyService(stores.benches, lambda _: devices, lambda _: Watch(None), stores.jobs.note)


def prepared(stores: Stores, driver: SimulatedDriver, lease_held: Callable[[], bool]) -> tuple[JobRunner, Job]:
    """A runner, and a job of its that has begun."""
    planner = planner_of(stores, driver)
    runner = JobRunner(stores, planner, driver, "test", lease_held)
    worker = Worker(runner, lambda _: IdleEngine(), lambda *_: IdleDispatcher())
    service = BenchService(stores, driver, planner, worker, "test", safety_of(stores, driver))
    service.register()  # and no begin: nobody would end its threads, which would write into other tests' logs
    job = service.jobs.submit(
        JobRequest(procedure="calibration_12_orientations", unit="SIM-0001", parameters=FAST, seed=1)
    )
    entry = stores.queue.look("sim", now()).next()
    assert entry is not None
    assert runner.claim(entry) is not None
    assert runner.stations(job.id, 1) == 12
    return runner, job
