"""Estimates of a job from what it has recorded so far, made in another process than the one that drives the bench."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

from bench_service.evidence.so_far.documents import JobEstimates
from bench_service.evidence.work_processes import WorkProcesses
from bench_service.model.job import Job
from bench_service.wall_clock import monotonic_s

KEPT = 8
"""Number of jobs whose estimates are remembered, each for `FRESH_S`."""
FRESH_S = 2.0
"""Time for which estimates are given again, whatever the number of clients that ask [s]."""


@dataclass(frozen=True)
class _Remembered:
    at_s: float
    text: str


class EstimateService:
    """Has estimates of jobs under way computed in another process, for the API."""

    def __init__(
        self, work_out: Callable[[str], str], read_job: Callable[[str], Job], processes: WorkProcesses | None = None
    ) -> None:
        """Set up with `work_out`, which gives the JSON of a `JobEstimates`: called where there are no processes."""
        self._work_out = work_out
        self._read_job = read_job
        self._processes = processes
        self._known: OrderedDict[str, _Remembered] = OrderedDict()
        self._mutex = Lock()

    def of_job(self, job_id: str) -> JobEstimates:
        """Wait for the estimates of a job from what is recorded, and return them. Raises `NotFound`, and `Overloaded`
        where too much work waits.
        """
        with self._mutex:
            known = self._known.get(job_id)
        if known is None or monotonic_s() - known.at_s >= FRESH_S:
            self._read_job(job_id)
            text = self._work_out(job_id) if self._processes is None else self._processes.result("so_far", job_id)
            known = _Remembered(monotonic_s(), text)
            with self._mutex:
                self._known[job_id] = known
                while len(self._known) > KEPT:
                    self._known.popitem(last=False)
        return JobEstimates.model_validate_json(known.text)
