"""Entry point of an analysis process: its connection to the database, its catalogue, and the numerics."""

from collections.abc import Callable
from typing import Any

from bench_service.evidence.analyses import AnalysisService
from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.recomputation import RecomputationService
from bench_service.evidence.work_processes import Run
from bench_service.persistence import open_stores


def open_run(database_url: str, code_version: str) -> Run:
    """Return the function that an analysis process runs, see `WorkProcesses`: "method" and "again" give a result's id,
    the others JSON.
    """
    from threadpoolctl import threadpool_limits

    from bench_service.evidence.so_far.estimating import Estimating

    stores, _ = open_stores(database_url)  # it is closed with the process
    catalogue = Catalogue()
    threadpool_limits(1)
    service = AnalysisService(stores, catalogue, stores.jobs.get, code_version)
    verbs: dict[str, Callable[..., str]] = {
        "method": lambda *of: service.run_method(*of).id,
        "again": lambda *of: service.analyse_again(*of).id,
        "recompute": RecomputationService(stores, catalogue, stores.jobs.get, code_version).as_json,
        "so_far": Estimating(stores, stores.jobs.get).text,
    }

    def run(name: str, arguments: tuple[Any, ...]) -> str:
        return verbs[name](*arguments)

    return run
