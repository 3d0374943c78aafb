"""Time of a batch of a hundred previews, by what varies; and of lists that are searched among 20 000 jobs.

Run alone: ``python -m tests.benchmarks.previews``. Exit code 1 if a budget is missed. The service's own CPU time stands
beside the wall time, which other work on the machine lengthens.
"""

import statistics
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

import psutil

from bench_service.model.job import Job, JobState
from bench_service.persistence import open_stores
from bench_service.wall_clock import monotonic_s, new_id, now
from tests.benchmarks.process import Service, service

PLANS, ROUNDS, JOBS = 100, 3, 20_000
CALIBRATION = "calibration_12_orientations"
BATCHES: dict[str, list[dict[str, Any]]] = {
    "calibrations of other dwell": [
        {"procedure": CALIBRATION, "unit": "SIM-0001", "parameters": {"dwell_s": 20.0 + k}} for k in range(PLANS)
    ],
    "calibrations of other units": [{"procedure": CALIBRATION, "unit": f"RANDOM-{k}"} for k in range(PLANS)],
    "static runs of other length": [
        {"procedure": "static_run", "unit": "SIM-0001", "parameters": {"duration_s": 1000.0 + k}} for k in range(PLANS)
    ],
}


@dataclass(frozen=True)
class Row:
    """One measured budget [s], and the CPU time that the service took for it [s]."""

    what: str
    wall_s: float
    cpu_s: float
    budget_s: float = 1.0

    @property
    def kept(self) -> bool:
        return self.wall_s <= self.budget_s


def measured(what: str, running: Service, method: str, path: str, **options: Any) -> Row:
    """Median of some rounds, after one that is not counted."""
    walls, cpus = [], []
    for _ in range(ROUNDS + 1):
        before_s, begun_s = _cpu_s(running), monotonic_s()
        running.client.request(method, path, **options).raise_for_status()
        walls.append(monotonic_s() - begun_s)
        cpus.append(_cpu_s(running) - before_s)
    return Row(what, statistics.median(walls[1:]), statistics.median(cpus[1:]))


def _cpu_s(running: Service) -> float:
    times = psutil.Process(running.process.pid).cpu_times()
    return times.user + times.system


def fill(url: str) -> None:
    """Store jobs of four months, a label on every thousandth."""
    stores, database = open_stores(url)
    begun = now() - timedelta(days=120)
    for k in range(JOBS):
        at = begun + timedelta(minutes=8 * k)
        labels = {"lot": "7"} if k % 1000 == 0 else {}
        head = f"{int(at.timestamp() * 1000):012x}"
        stores.jobs.add(_job(f"{head[:8]}-{head[8:]}{new_id()[13:]}", at, labels))
    database.dispose()


def _job(name: str, at: Any, labels: dict[str, str]) -> Job:
    return Job(
        id=name,
        procedure="static_run",
        procedure_version="1",
        unit="U-1",
        bench="elsewhere",
        state=JobState.SUCCEEDED,
        created_at=at,
        requested_parameters={},
        parameters={"duration_s": 1.0},
        context={"unit": {"serial": "U-1"}},
        stations=(),
        duration_s=1.0,
        code_version="abc",
        simulated=True,
        seed=1,
        labels=labels,
    )


def rows() -> Iterator[Row]:
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        url = f"sqlite:///{folder}/bench.sqlite"
        fill(url)
        with service(url) as running:
            for what, plans in BATCHES.items():
                yield measured(f"{PLANS} {what}", running, "POST", "/api/v1/previews", json={"plans": plans})
            moment = (now() - timedelta(days=100)).isoformat()
            searches = {"label": "lot=7", "text": "nothing like it", "until": moment, "verdict": "fail"}
            for name, value in searches.items():
                what = f"search of {JOBS} jobs by {name}"
                yield measured(what, running, "GET", "/api/v1/jobs", params={name: value})


if __name__ == "__main__":
    kept = True
    for row in rows():
        kept &= row.kept
        missed = "" if row.kept else "  MISSED"
        print(
            f"{row.what:45} {row.wall_s:6.2f} s (CPU {row.cpu_s:5.2f} s), {row.budget_s:g} s allowed{missed}",
            flush=True,
        )
    sys.exit(0 if kept else 1)
