"""Measures of a revision, through its service or in its own interpreter; all that any two revisions both have.

A measure returns figures of one round by their labels; a unit is the end of its label.
"""

import os
import statistics
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import httpx

from bench_service.wall_clock import monotonic_s, pause
from tests.benchmarks.process import Service
from tests.benchmarks.revision import Revision

Figures = dict[str, float]
Measure = Callable[[Revision], Figures]
POLL_S = 0.05
"""Between two questions whether a long job has ended: more often would take time from it."""
STATIC = {"launches": 1, "duration_s": 6 * 3600.0, "off_time_s": 1.0}
NO_OPS = 50
SPREAD_S = 10.0
"""Time after the start over which no-ops are spread: work that a start puts off falls on some of them."""
SETTLED_S = 5.0

ALLAN = """
import time, numpy as np
from procedures.analysis.allan.deviation import deviation
from procedures.analysis.allan.statistic import STATISTICS, log_sizes
n, rate = 8_640_000, 400.0
rng = np.random.default_rng(1)
y = rng.normal(size=n) + np.diff(rng.normal(0.0, 20.0, n + 1))
def took(statistic):
    sizes = log_sizes(statistic.largest(n), 226)
    found = []
    for _ in range(5):
        wall, used = time.perf_counter(), time.process_time()
        deviation(y, rate, statistic, sizes=sizes)
        found.append((time.process_time() - used, time.perf_counter() - wall))
    return [sorted(column)[2] * 1e3 for column in zip(*found)]
one = took(STATISTICS["overlapping_allan"])
print(one[0], one[1], sum(took(s)[0] for s in STATISTICS.values()))
"""


def help_page(revision: Revision) -> Figures:
    """``bench --help``."""
    begun = monotonic_s()
    revision_bench = str(revision.python.with_name("bench"))
    subprocess.run([revision_bench, "--help"], cwd=revision.folder, stdout=subprocess.DEVNULL, check=True)
    return {"bench --help, s": monotonic_s() - begun}


def cold(revision: Revision) -> Figures:
    """From exec to the first answer and to the end of the first no-op, on an empty database."""
    begun = monotonic_s()
    with revision.service() as running:
        first = monotonic_s() - begun
        running.finish(procedure="no_operation")
        ended = monotonic_s() - begun
        return {
            "exec to first 200, s": first,
            "exec to end of first no-op, s": ended,
            "exec to end of first no-op, processor s": running.processor_s(),
        }


def no_ops(revision: Revision) -> Figures:
    """Submitted to finished, spread over the first seconds after a start, and one after another when all is warm."""
    with revision.service() as running:
        begun, spread = monotonic_s(), list[float]()
        for number in range(NO_OPS):
            pause(max(0.0, begun + SPREAD_S * number / NO_OPS - monotonic_s()))
            spread.append(_took_ms(running))
        warm = [_took_ms(running) for _ in range(NO_OPS)]
    return {
        "no-op over the first 10 s, p50, ms": statistics.median(spread),
        "no-op over the first 10 s, p95, ms": sorted(spread)[int(0.95 * NO_OPS)],
        "no-op warm, p50, ms": statistics.median(warm),
        "no-op warm, p95, ms": sorted(warm)[int(0.95 * NO_OPS)],
    }


def static(revision: Revision) -> Figures:
    """A static launch of 6 h × 400 Hz × 6 channels: simulated, stored, analysed; and its analysis once more."""
    with revision.service() as running:
        pause(SETTLED_S)
        idle = running.memory_mb()
        begun, used = monotonic_s(), running.processor_s()
        job = running.finish(POLL_S, procedure="static_run", parameters=STATIC)
        whole, whole_processor = monotonic_s() - begun, running.processor_s() - used
        peak, others = running.peak_memory_mb(), running.peaks_mb()
        again = analysed_again(running, job)
    apart = [mb for name, mb in others.items() if name.startswith("spawn_main")]
    return {
        "static launch of 6 h, s": whole,
        "static launch of 6 h, processor s": whole_processor,
        "its second analysis, s": again,
        "service idle, MB": idle["service"],
        "all its processes idle, MB": sum(idle.values()),
        "service at its peak, MB": peak,
        "greatest other process, MB": max(apart, default=0.0),
    }


def thermal(revision: Revision) -> Figures:
    """A thermal cycle as it ships: three runs of 12 h."""
    with revision.service() as running:
        begun, used = monotonic_s(), running.processor_s()
        running.finish(POLL_S, procedure="thermal_cycle", parameters={})
        return {
            "thermal cycle, s": monotonic_s() - begun,
            "thermal cycle, processor s": running.processor_s() - used,
            "thermal cycle, service at its peak, MB": running.peak_memory_mb(),
        }


def exports(revision: Revision) -> Figures:
    """Parquet and CSV of a recording of 12 h × 100 Hz × 13 channels, one minute of it as Arrow."""
    with revision.service() as running:
        job = running.finish(POLL_S, procedure="thermal_cycle", parameters={})
        recording = running.client.get("/api/v1/recordings", params={"job": job["id"]}).json()["items"][0]["id"]
        path = f"/api/v1/recordings/{recording}/data"
        figures: Figures = {}
        for form in ("parquet", "csv"):
            begun = monotonic_s()
            _drained(running, path, {"format": form})
            figures[f"12 h thermal recording as {form}, s"] = monotonic_s() - begun
        minute = {"format": "arrow", "start_s": 21_600.0, "stop_s": 21_660.0}
        times = [_timed(lambda: _drained(running, path, minute)) for _ in range(20)]
    return figures | {"1 min of it as Arrow, ms": statistics.median(times) * 1e3}


def campaign(revision: Revision) -> Figures:
    """The whole campaign that ships, from the command to its end."""
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        environment = {**os.environ, "BENCH_DATABASE_URL": f"sqlite:///{Path(folder) / 'bench.sqlite'}"}
        arguments = [str(revision.python), "-m", "bench_service", "campaign", "run", "thesis_acceptance"]
        begun = monotonic_s()
        done = subprocess.run(
            [*arguments, "--unit", "SIM-0001", "--seed", "1", "--json"],
            cwd=revision.folder,
            env=environment,
            stdout=subprocess.DEVNULL,
            check=False,
        )
        took = monotonic_s() - begun
    if done.returncode not in (0, 1, 2):
        raise RuntimeError(f"the campaign of {revision.name} ended with {done.returncode}")
    return {"whole campaign, s": took}


def allan(revision: Revision) -> Figures:
    """Overlapping Allan deviation of 8.64 M samples at 200 sizes, one BLAS thread; and all six statistics."""
    processor, wall, six = map(float, revision.script(ALLAN).split())
    return {"overlapping Allan, processor ms": processor, "overlapping Allan, ms": wall, "six statistics, ms": six}


def analysed_again(running: Service, job: dict) -> float:
    """Wall time of a second analysis of a job [s]; the first of a process that begins for it is not counted."""
    path = f"/api/v1/jobs/{job['id']}/analyses"
    times = [_timed(lambda: running.client.post(path, json={}).raise_for_status()) for _ in range(3)]
    return statistics.median(times[1:])


MEASURES: dict[str, Measure] = {
    "help": help_page,
    "start": cold,
    "no_op": no_ops,
    "allan": allan,
    "static": static,
    "thermal": thermal,
    "exports": exports,
    "campaign": campaign,
}


def _took_ms(running: Service) -> float:
    return _timed(lambda: running.finish(procedure="no_operation")) * 1e3


def _timed(work: Callable[[], object]) -> float:
    begun = monotonic_s()
    work()
    return monotonic_s() - begun


def _drained(running: Service, path: str, query: dict[str, object]) -> None:
    with running.client.stream("GET", path, params=query) as answer:  # pyright: ignore[reportArgumentType]
        if answer.status_code != httpx.codes.OK:
            answer.read()
            answer.raise_for_status()
        for _ in answer.iter_raw():
            pass
