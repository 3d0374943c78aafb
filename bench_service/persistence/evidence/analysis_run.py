"""Entry point of an analysis process: its connection to the database, its catalogue, and the numerics."""

from typing import Any

from bench_service.evidence.analyses import AnalysisService
from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.work_processes import Run
from bench_service.persistence import open_stores


def open_run(database_url: str, code_version: str) -> Run:
    """Prepare an analysis process, see `WorkProcesses`: "method" and "again" are verbs of `AnalysisService`,
    "so_far" is the one of `Estimating`.
    """
    from threadpoolctl import threadpool_limits

    from bench_service.evidence.estimating import Estimating

    stores, _ = open_stores(database_url)  # it is closed with the process
    service = AnalysisService(stores, Catalogue(), stores.jobs.get, code_version)
    threadpool_limits(1)
    verbs = {"method": service.run_method, "again": service.analyse_again}
    estimates = Estimating(stores, stores.jobs.get)

    def run(name: str, arguments: tuple[Any, ...]) -> str:
        return estimates.text(*arguments) if name == "so_far" else verbs[name](*arguments).id

    return run
