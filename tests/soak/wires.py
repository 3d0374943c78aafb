"""A soak over wires: jobs on a bench of drivers at served simulators, with a fault every minute on average.

`python -m tests.soak.wires --minutes 12 [--kill-s 120]`; `make soak WIRES=1`, and with kills `make chaos WIRES=1`.
Faults come at random times (Poisson, by the seed): slow, half, doubled and cut answers, frames that are spoilt or lost,
a stuck encoder, trips, an open door, open interlocks, a line pulled out. A person puts right what needs one, and
releases the bench. With `--kill-s` the service is killed as well, at random times of that mean. Exit code 0 where

* each stored recording is a stretch of what the unit sent, sample by sample, and of the length that was asked for;
* no demand for an angle of one station came twice to the table (its own journal is the witness), but for a station that
  is repeated after a kill;
* no job failed without a reason, nor without a fault, and jobs succeed after the last fault;
* descriptors and threads stay level, and memory has a slope that shows no growth (not judged with kills).
"""

import argparse
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from random import Random
from typing import Any

import httpx
import numpy as np
import psutil

from bench_service.drivers.device_register import DeviceRegister
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.wall_clock import monotonic_s, pause
from simulators.served.pace import MADE_UP_S
from tests.benchmarks.process import free_port
from tests.conformance.served import served
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.wired_bench import THERMAL_LANGUAGES, bench_file
from tests.soak.descriptors import Descriptors, descriptors_of
from tests.soak.level import Samples, growing
from tests.soak.wire_faults import Faults
from tests.soak.wire_journal import Journal

RECORD_S, STATIONS = 2.0, 3
RATE_HZ = 400.0
EVERY_S = 2.0
"""Interval between two looks at the process [s]."""
CALM_S = 25.0
"""Time without faults at the end, in which a job must succeed [s]."""
WARM_S = 60.0
"""Longest wait for the process that draws [s]. The service begins it while no job runs: under load that is late, and
its nine pipes are no growth."""
MANUAL, MANUAL_SHARE = "/api/v1/benches/east/manual", 0.15
BY_HAND_S = 4.0
EXPLAINED_S = 90.0
"""Time after a fault, or a kill, within which a job may fail of it [s]."""
ENDED = ("succeeded", "failed", "cancelled", "interrupted")


class WiredLoad:
    """One job after the other; what became of each, and the recordings that were checked."""

    def __init__(self, bench: BenchProcess, seed: int, tick: Callable[[], None]) -> None:
        """Set up; `tick` is called while an act of the load waits."""
        self._bench, self._chance, self._tick = bench, Random(seed), tick
        self.jobs: list[dict[str, Any]] = []
        self.states: Counter[str] = Counter()
        self.reasons: Counter[str] = Counter()
        self.asked: set[str] = set()
        """Texts of the angles that were asked of the middle axis, one a station: no other demand has them."""
        self._job: str | None = None
        self.succeeded_s = 0.0

    def step(self) -> None:
        """Submit a job, or look at the one under way; release the bench where a stop stands."""
        client = self._bench.client
        try:
            self._release(client)
            if self._job is None and self._chance.random() < MANUAL_SHARE:
                self._by_hand(client)
            elif self._job is None:
                self._job = self._submit(client)
            else:
                self._look(client, self._job)
        except httpx.TransportError:
            return  # the service was killed, and is starting

    def _by_hand(self, client: httpx.Client) -> None:
        """Lead the chamber away from ambient for a while by manual mode; its end leads it back."""
        lease = client.post(MANUAL, json={"reason": "a soak", "by": "ann", "unit": "GL017"})
        if lease.status_code != 201:
            self.reasons[f"no lease: {lease.status_code}"] += 1
            return
        path, target = f"{MANUAL}/{lease.json()['id']}", round(self._chance.uniform(26.0, 40.0), 2)
        made = client.post(f"{path}/demands", json={"kind": "chamber", "temperature_c": target, "by": "ann"})
        until_s = monotonic_s() + BY_HAND_S
        while monotonic_s() < until_s:
            self._tick()
            pause(0.1)
        state = "refused"
        if made.status_code == 202:
            state = client.get(f"{path}/demands/{made.json()['key']}").json().get("state", "unknown")
        self.states[f"by hand, {state}"] += 1
        client.post(f"{path}/end", json={"by": "ann"})

    def _submit(self, client: httpx.Client) -> str | None:
        angles = [round(self._chance.uniform(-150.0, 150.0), 4) for _ in range(STATIONS)]
        positions = [[0.0, angle, 0.0, RECORD_S] for angle in angles]
        parameters = {"positions": positions, "delay_from": "rest", "settle_s": 0.5}
        body = {"procedure": "table_program", "unit": "GL017", "parameters": parameters}
        answer = client.post("/api/v1/jobs", json=body)
        if answer.status_code != 202:
            self.reasons[f"not taken: {answer.status_code}"] += 1
            return None
        self.asked |= {f"{angle:.5f}" for angle in angles}
        return answer.json()["id"]

    def _look(self, client: httpx.Client, job_id: str) -> None:
        job = client.get(f"/api/v1/jobs/{job_id}").json()
        if job.get("state") not in ENDED:
            return
        self._job = None
        self.jobs.append({**job, "ended_s": monotonic_s()})
        self.states[job["state"]] += 1
        if job["state"] == "succeeded":
            self.succeeded_s = monotonic_s()
        else:
            self.reasons[_kind_of(job)] += 1

    def _release(self, client: httpx.Client) -> None:
        if client.get("/api/v1/benches/east").json().get("state") == "stopped":
            client.post("/api/v1/benches/east/release", json={"remark": "looked, and put right"})

    @property
    def idle(self) -> bool:
        """True where no job is under way."""
        return self._job is None

    def recordings(self) -> list[dict[str, Any]]:
        """All recordings of the jobs that ended."""
        return [r for job in self.jobs for r in self._bench.recordings(job["id"])]


def _kind_of(job: dict[str, Any]) -> str:
    error = job.get("error") or {}
    text = str(error.get("message", error) if isinstance(error, dict) else error)
    return f"{job['state']}: {text[:70]}"


def checked_recordings(load: WiredLoad, client: httpx.Client, journal: Journal) -> tuple[int, list[str]]:
    """Number of recordings that are stretches of what the unit sent, and a sentence for each that is not."""
    import pyarrow as pa

    good, wrong = 0, list[str]()
    for recording in load.recordings():
        answer = client.get(f"/api/v1/recordings/{recording['id']}/data", params={"format": "arrow"})
        table = pa.ipc.open_stream(answer.content).read_all()
        names = [c["name"] for c in recording["channels"]]
        rows = np.column_stack([table.column(name).to_numpy() for name in names]).astype(np.int32)
        if len(rows) != round(RECORD_S * RATE_HZ):
            wrong.append(f"recording {recording['id']} has {len(rows)} samples, not {RECORD_S * RATE_HZ:g}")
        elif not journal.sent(rows):
            wrong.append(f"recording {recording['id']} is no stretch of what the unit sent")
        else:
            good += 1
    return good, wrong


@contextmanager
def _looked_at(bench: BenchProcess) -> Generator[psutil.Process]:
    """The service's process; what is taken of it is left out where it has ended."""
    with suppress(psutil.NoSuchProcess):
        yield psutil.Process(bench.process.pid)


def run(minutes: float, factor: float, seed: int, mean_s: float, kill_s: float) -> list[str]:
    """Run the soak; print its figures, and return what was not kept."""
    chance, samples, descriptors = Random(seed), Samples(), Descriptors()
    with (
        tempfile.TemporaryDirectory(prefix="wires-") as name,
        served(THERMAL_LANGUAGES, True, factor, made_up_s=MADE_UP_S) as behind,
    ):
        folder, journal, faults = Path(name), Journal(behind), Faults(behind, Random(seed + 1), mean_s)
        file = bench_file(folder, behind, factor, after_demand_s=0.02)
        bench = BenchProcess(f"sqlite:///{folder / 'bench.sqlite'}", free_port(), folder, file=str(file))
        bench.register, bench.files = DeviceRegister(folder, "east"), HostFiles(folder, "east")
        load = WiredLoad(bench, seed, faults.step)
        kills, next_kill_s = list[float](), monotonic_s() + (chance.expovariate(1.0 / kill_s) if kill_s else np.inf)
        try:
            bench.start()
            bench.until(lambda: descriptors_of(psutil.Process(bench.process.pid), {})["pipe"] > 0, WARM_S)
            begun_s, looked_s, at_rest_s = monotonic_s(), 0.0, 0.0
            names = {bench.client.base_url.port or 0: "clients"} | {n: f"the {k}" for k, n in behind.numbers.items()}
            end_s = begun_s + 60.0 * minutes
            while monotonic_s() < end_s:
                if monotonic_s() < end_s - CALM_S:
                    faults.step()
                else:
                    faults.put_right()
                if monotonic_s() > next_kill_s and monotonic_s() < end_s - 2.0 * CALM_S:
                    bench.kill()
                    bench.start()
                    kills, samples, descriptors = [*kills, monotonic_s()], Samples(), Descriptors()
                    next_kill_s = monotonic_s() + chance.expovariate(1.0 / kill_s)
                load.step()
                if load.idle and monotonic_s() - at_rest_s > 1.0:  # between two jobs: what a job needs is given back
                    at_rest_s = monotonic_s()
                    with _looked_at(bench) as process:
                        descriptors.take((at_rest_s - begun_s) / 60.0, descriptors_of(process, names))
                if monotonic_s() - looked_s > EVERY_S:
                    looked_s = monotonic_s()
                    with _looked_at(bench) as process:
                        samples.take((looked_s - begun_s) / 60.0, process, folder)
                pause(0.1)
            bench.until(lambda: _idle(load), 120)
            print(f"descriptors at the end: {dict(descriptors.kinds[-1].most_common())}")
            good, wrong = checked_recordings(load, bench.client, journal)
            print(f"samples behind the bench's clock: {_behind(load)}")
        finally:
            bench.end()
        wrong += _of_jobs(load, [*faults.times, *kills], journal, end_s - CALM_S, len(kills))
        print(f"{minutes:g} min, factor {factor:g}, seed {seed}, {len(kills)} kills; faults: {faults.told()}")
        print(f"jobs: {dict(load.states)}; recordings that are what the unit sent: {good}")
        print(*(f"  {count} × {reason}" for reason, count in load.reasons.most_common(12)), sep="\n")
        late_s = behind.bench.pace.behind_s
        print(f"table: {journal.demands} demands, {journal.requests} requests; {late_s:.1f} s of bench time given up")
    return wrong + (descriptors.judged(minutes) + growing(samples, minutes) if not kill_s else [])


def _behind(load: WiredLoad) -> str:
    """Recordings whose pace was measured, and the worst of them."""
    paces = [p for r in load.recordings() if (p := (r.get("measured") or {}).get("pace")) is not None]
    worst = max((abs(p["behind_s"]) for p in paces), default=0.0)
    return f"{worst:.2f} s at worst within {RECORD_S:g} s, of {len(paces)} recordings whose pace was measured"


def _idle(load: WiredLoad) -> bool:
    if not load.idle:
        load.step()
    return load.idle


def _of_jobs(load: WiredLoad, causes: Sequence[float], journal: Journal, calm_s: float, kills: int) -> list[str]:
    """Sentences on demands, reasons and causes. `causes`: moments of faults and kills."""
    twice = journal.twice(load.asked)
    repeated = sum(count - 1 for _, count in twice)
    wrong = [f"the table was asked {count} times for {text} deg" for text, count in twice if repeated > kills]
    wrong += [f"no reason: {reason}" for reason in load.reasons if reason.endswith((": ", ": None", ": {}"))]
    for job in load.jobs:
        if job["state"] != "succeeded" and not any(0.0 <= job["ended_s"] - t <= EXPLAINED_S for t in causes):
            wrong.append(f"job {job['id']} failed with no fault before it: {_kind_of(job)}")
    if load.succeeded_s < calm_s:
        wrong.append("no job succeeded after the last fault")
    return wrong


def main(arguments: Sequence[str] | None = None) -> int:
    """0 where everything was kept."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=12.0)
    parser.add_argument("--factor", type=float, default=8.0, help="bench seconds in a real second")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--mean-s", type=float, default=60.0, help="mean time between two faults [s]")
    parser.add_argument("--kill-s", type=float, default=0.0, help="mean time between two kills [s]; 0: none")
    given = parser.parse_args(arguments)
    print(f"load average {os.getloadavg()[0]:.1f}")
    wrong = run(given.minutes, given.factor, given.seed, given.mean_s, given.kill_s)
    print(*(f"NOT KEPT: {each}" for each in wrong) if wrong else ["every promise was kept"], sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
