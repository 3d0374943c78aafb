"""Entry point of an analysis process: its connection to the database, its catalogue, and the numerics."""

from typing import Any

from bench_service.evidence.analyses import AnalysisService
from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.recomputation import RecomputationService
from bench_service.evidence.work_processes import Run
from bench_service.persistence import open_stores


def open_run(database_url: str, code_version: str) -> Run:
    """Prepare an analysis process, see `WorkProcesses`: "method" and "again" give a result's id, "recompute" JSON."""
    from threadpoolctl import threadpool_limits

    stores, _ = open_stores(database_url)  # it is closed with the process
    catalogue = Catalogue()
    service = AnalysisService(stores, catalogue, stores.jobs.get, code_version)
    second = RecomputationService(stores, catalogue, stores.jobs.get, code_version)
    threadpool_limits(1)
    verbs = {"method": service.run_method, "again": service.analyse_again}

    def run(name: str, arguments: tuple[Any, ...]) -> str:
        return second.as_json(*arguments) if name == "recompute" else verbs[name](*arguments).id

    return run
