"""``python -m tests.benchmarks.listeners [PAIRS]``: one job's events while 200 listen to it.

The same job alone and with 200 who are there before it begins and stay, in pairs whose order alternates (ABBA). The
service has one core and the listeners another, where there are two, so that the job pays for what the service does for
listeners and not for them. Judged by the 95 % interval of the mean ratio (paired, of the logarithms) of the service's
processor time, at most 5 % more: on a core of its own that is what the job loses, and others' work on the machine does
not count. Wall time is printed beside it, and what the thread that serves HTTP has used, which is the larger part of
what listeners cost and can be seen where the whole is lost in the noise.

Then once more, each losing his connection twice: events missed or doubled, and the delay from an event's time to a
listener's ear.
"""

import json
import math
import os
import statistics
import subprocess
import sys
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import datetime

import numpy as np
import psutil
from scipy import stats

from bench_service.wall_clock import pause
from tests.benchmarks.process import Service, service

LISTENERS = 200
LOSSES = 2
PAIRS = 8
MOST = 0.05
JOB = {"procedure": "calibration_12_orientations", "parameters": {"dwell_s": 3600.0, "scalar_check": False}, "seed": 1}


@dataclass(frozen=True)
class Round:
    """One job: its wall time, the service's processor time meanwhile and while the listeners came, what they heard."""

    wall_s: float
    processor_s: float
    loop_s: float
    """The part of the thread that serves HTTP."""
    coming_s: float = 0.0
    wrong: int = 0
    """Listeners who heard not exactly everything."""
    delays_s: tuple[float, ...] = ()


@contextmanager
def on_core(number: int) -> Generator[bool]:
    """Processes started in the block run on one of our cores; False: there are not two, so they run on all of them."""
    cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_setaffinity") else []
    if len(cores) < 2:
        yield False
        return
    os.sched_setaffinity(0, {cores[number]})
    try:
        yield True
    finally:
        os.sched_setaffinity(0, cores)


def one_job(running: Service, losses: int | None) -> Round:
    """Run a job while all listen, each losing his connection so often; None: nobody listens."""
    server, post = psutil.Process(running.process.pid), running.client.post
    post("/api/v1/benches/sim/stop").raise_for_status()
    job = post("/api/v1/jobs", json={"unit": "SIM-0001", **JOB}).raise_for_status().json()["id"]
    ears, before_s = None, _processor_s(server)
    if losses is not None:
        base = running.client.base_url
        command = [sys.executable, "-m", "tests.benchmarks.crowd", base.host, str(base.port), job, str(LISTENERS)]
        with on_core(1):
            ears = subprocess.Popen([*command, str(losses)], stdout=subprocess.PIPE, text=True)
        assert ears.stdout is not None
        assert ears.stdout.readline() == "here\n"
    begun_s, loop_s = _processor_s(server), _loop_s(server)
    post("/api/v1/benches/sim/release").raise_for_status()
    while (now := running.client.get(f"/api/v1/jobs/{job}").json())["state"] in ("queued", "running"):
        pause(0.5)
    assert now["state"] == "succeeded", now
    used_s, loop_s = _processor_s(server) - begun_s, _loop_s(server) - loop_s
    wall_s = (datetime.fromisoformat(now["finished_at"]) - datetime.fromisoformat(now["started_at"])).total_seconds()
    if ears is None:
        return Round(wall_s, used_s, loop_s)
    said = json.loads(ears.communicate(timeout=120)[0])
    stored = running.client.get(f"/api/v1/jobs/{job}/events").text.splitlines()
    all_of_it = [int(line.removeprefix("id: ")) for line in stored if line.startswith("id: ")]
    assert len(all_of_it) >= 2 + 12 + 1, all_of_it  # queued, running, twelve stations, succeeded
    wrong = sum(heard != all_of_it for heard in said["heard"])
    return Round(wall_s, used_s, loop_s, begun_s - before_s, wrong, tuple(said["delays_s"]))


def _processor_s(process: psutil.Process) -> float:
    used = process.cpu_times()
    return used.user + used.system


def _loop_s(process: psutil.Process) -> float:
    """Processor time of the main thread, which uvicorn runs in [s]."""
    return next(thread.user_time + thread.system_time for thread in process.threads() if thread.id == process.pid)


def more(alone: list[float], listened: list[float]) -> tuple[float, float, float]:
    """Mean ratio of the pairs less one, and its 95 % interval (Student's t over the logarithms)."""
    logarithms = np.log(np.array(listened) / np.array(alone))
    interval = stats.ttest_1samp(logarithms, 0.0).confidence_interval(0.95)
    return math.expm1(logarithms.mean()), math.expm1(interval.low), math.expm1(interval.high)


def judged(low: float, high: float) -> str:
    """Verdict of an interval about the limit."""
    if high <= MOST:
        return f"at most {MOST:.0%}: kept"
    return f"at most {MOST:.0%}: missed" if low > MOST else f"at most {MOST:.0%}: not decided on a machine so busy"


def heard(what: str, rounds: list[Round]) -> int:
    """Print what listeners heard; how many not exactly everything."""
    delays = sorted(d for r in rounds for d in r.delays_s)
    p50, p95 = statistics.median(delays) * 1e3, delays[int(0.95 * len(delays))] * 1e3
    wrong = sum(r.wrong for r in rounds)
    print(f"{what}: {wrong} heard not exactly everything; delay p50 {p50:.0f} ms, p95 {p95:.0f} ms", flush=True)
    return wrong


def main(pairs: int) -> int:
    """Print; 1 where somebody missed something or the job took more than 5 % more of the service's time."""
    alone: list[Round] = []
    listened: list[Round] = []
    with ExitStack() as closing:
        with on_core(0) as apart:
            running = closing.enter_context(service())
        print("service and listeners on a core each" if apart else "service and listeners share what cores there are")
        one_job(running, None)  # the first job also imports and compiles
        for number in range(pairs):
            turns = [(alone, None), (listened, 0)]
            for into, losses in turns if number % 2 == 0 else reversed(turns):
                into.append(one_job(running, losses))
        lost = one_job(running, LOSSES)
        scrape = running.client.get("/metrics").text
    high = low = 0.0
    for what in ("wall_s", "processor_s"):
        without, with_them = ([getattr(r, what) for r in rounds] for rounds in (alone, listened))
        mean, low, high = more(without, with_them)
        print(f"{what}: {_shown(without)} alone, {_shown(with_them)} while {LISTENERS} listen")
        print(f"{what}: {mean:+.1%} (95 %: {low:+.1%} … {high:+.1%})", flush=True)
    print(f"processor time of the job, {judged(low, high)}")
    serving_s = statistics.median(r.loop_s for r in listened) - statistics.median(r.loop_s for r in alone)
    job_s = statistics.median(r.processor_s for r in alone)
    print(f"the thread that serves HTTP, little disturbed: {serving_s:+.2f} s, {serving_s / job_s:+.1%} of the job")
    coming_s = statistics.median(r.coming_s for r in listened)
    print(f"before it begins, once: {coming_s / LISTENERS * 1e3:.1f} ms of processor time for each who comes")
    wrong = heard("staying", listened) + heard(f"losing the connection {LOSSES} times", [lost])
    print(next(line for line in scrape.splitlines() if line.startswith("bench_listeners_dropped_total")))
    return 0 if wrong == 0 and low <= MOST else 1


def _shown(seconds: list[float]) -> str:
    return f"{statistics.median(seconds):.2f} s ({', '.join(f'{s:.2f}' for s in seconds)})"


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else PAIRS))
