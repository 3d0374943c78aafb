"""A soak: mixed load on one service for a stated time, and whether memory, descriptors, threads and logs stay level.

`python -m tests.soak --minutes 60`; `make soak MINUTES=60`. Exit code 0: level, 1: something grows or failed.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import numpy as np
import psutil

from bench_service.wall_clock import monotonic_s, pause
from tests.benchmarks.process import free_port
from tests.soak.load import Load
from tests.soak.slope import Slope, slope

EVERY_S = 2.0
"""Interval between two samples [s]."""
LEVEL_MB = 0.3
"""Growth of memory that counts as level [MB a minute]: below it with 95 % confidence. A service without the limit on
arenas grew by 2.7 after twenty minutes."""
GROWN = 8
"""Descriptors or threads by which the last quarter may exceed the quarter before the middle."""
WAL_MB = 80.0
"""Longest write-ahead log: SQLite cuts it back to 64 MB, and may be writing."""
LOGS_KB = 61_000.0
"""Longest logs [kB]: six files of 10 MB, and what was printed besides."""


@dataclass
class Samples:
    """Figures of the service over the run, one value a sample."""

    minutes: list[float] = field(default_factory=list)
    memory_mb: list[float] = field(default_factory=list)
    with_children_mb: list[float] = field(default_factory=list)
    descriptors: list[int] = field(default_factory=list)
    threads: list[int] = field(default_factory=list)
    wal_mb: list[float] = field(default_factory=list)
    log_kb: list[float] = field(default_factory=list)

    def take(self, minutes: float, process: psutil.Process, folder: Path) -> None:
        """Add a sample."""
        children = process.children(recursive=True)
        self.minutes.append(minutes)
        self.memory_mb.append(process.memory_info().rss / 1e6)
        self.with_children_mb.append(self.memory_mb[-1] + sum(map(_memory_mb, children)))
        self.descriptors.append(process.num_fds())
        self.threads.append(process.num_threads())
        self.wal_mb.append(_bytes(folder / "bench.sqlite-wal") / 1e6)
        self.log_kb.append(sum(map(_bytes, [*folder.glob("*.log*"), *folder.glob("*.out")])) / 1e3)


def _memory_mb(child: psutil.Process) -> float:
    try:
        return child.memory_info().rss / 1e6
    except psutil.NoSuchProcess:
        return 0.0


def _bytes(file: Path) -> int:
    try:
        return file.stat().st_size
    except OSError:
        return 0


def judged(name: str, found: Slope) -> list[str]:
    """The reason why a slope of memory is not level, if there is one: level is an interval below the bound."""
    if found.high < LEVEL_MB:
        return []
    if found.low > LEVEL_MB:
        return [f"{name} grows by {found} MB: more than {LEVEL_MB} MB"]
    return [f"{name}: {found} MB does not tell growth by {LEVEL_MB} MB from none: the soak was too short or too uneven"]


def judge(samples: Samples, minutes: float) -> list[str]:
    """Print what was seen; return what is not level."""
    times = np.array(samples.minutes)
    late = times >= minutes / 4.0
    wrong: list[str] = []
    for name, values in (("memory", samples.memory_mb), ("memory with children", samples.with_children_mb)):
        series = np.array(values)
        print(f"{name}: {series[0]:.0f} MB at first, {series[late].mean():.0f} MB later, {series.max():.0f} MB at most")
        print(f"  by quarter: {', '.join(f'{quarter.mean():.0f}' for quarter in np.array_split(series, 4))} MB")
        try:
            found = slope(times[late], series[late])
        except ValueError as error:
            wrong.append(f"{name}: no slope, {error}")
            continue
        print(f"  over the last {minutes * 0.75:.0f} min: {found} MB")
        faults = judged(name, found)
        if name == "memory" or found.low > LEVEL_MB:
            wrong += faults
        else:  # children come and go: what they add is uneven
            print("".join(f"  {fault}" for fault in faults) or "  level")
    for name, counts in (("descriptors", samples.descriptors), ("threads", samples.threads)):
        quarters = np.array_split(np.array(counts), 4)
        print(f"{name}: {', '.join(str(int(q.max())) for q in quarters)} at most in each quarter")
        if quarters[3].max() > quarters[1].max() + GROWN:
            wrong.append(f"{name} grow: {quarters[1].max()} to {quarters[3].max()}")
    print(f"write-ahead log: {max(samples.wal_mb):.1f} MB at most")
    if max(samples.wal_mb) > WAL_MB:
        wrong.append(f"the write-ahead log has {max(samples.wal_mb):.0f} MB")
    per_min = (samples.log_kb[-1] - samples.log_kb[0]) / max(times[-1] - times[0], 1e-9)
    print(f"logs: {samples.log_kb[-1]:.0f} kB, {per_min:.1f} kB a minute")
    if samples.log_kb[-1] > LOGS_KB:
        wrong.append(f"the logs have {samples.log_kb[-1] / 1e3:.0f} MB")
    return wrong


def soak(minutes: float, pause_s: float, seed: int, save: Path | None = None) -> int:
    """Run the soak; return the exit code. `save`: a file for all samples, as JSON."""
    with tempfile.TemporaryDirectory(prefix="bench-soak-") as name:
        folder, port = Path(name), free_port()
        address = f"http://127.0.0.1:{port}"
        environment = {
            **os.environ,
            "BENCH_DATABASE_URL": f"sqlite:///{folder / 'bench.sqlite'}",
            "BENCH_PORT": str(port),
            "BENCH_LOG_FILE": str(folder / "bench.log"),
        }
        process = subprocess.Popen([sys.executable, "-m", "bench_service", "serve"], env=environment)
        load, samples = Load(address, seed, pause_s), Samples()
        try:
            _until_ready(address, process)
            load.begin()
            begun_s, watched = monotonic_s(), psutil.Process(process.pid)
            while (passed := (monotonic_s() - begun_s) / 60.0) < minutes:
                if process.poll() is not None:
                    print(f"the service ended with {process.returncode}")
                    return 1
                samples.take(passed, watched, folder)
                pause(EVERY_S)
            load.end()
            database_mb = _bytes(folder / "bench.sqlite") / 1e6
        finally:
            process.terminate()
            process.wait(60)
        print(f"{minutes:g} min, seed {seed}: {', '.join(f'{n} × {k}' for k, n in sorted(load.answers.items()))}")
        print(f"database: {database_mb:.1f} MB")
        if save is not None:
            save.write_text(json.dumps(vars(samples)))
        wrong = judge(samples, minutes)
    wrong += [f"no {kind} has succeeded" for kind in load.never]
    wrong += [f"{count} × {fault}" for fault, count in load.faults.items()]
    if process.returncode != 0:
        wrong.append(f"the service ended with {process.returncode}")
    print("\n".join(f"NOT level: {each}" for each in wrong) or "level")
    return 1 if wrong else 0


def _until_ready(address: str, process: "subprocess.Popen[bytes]") -> None:
    deadline = monotonic_s() + 60
    while monotonic_s() < deadline and process.poll() is None:
        try:
            if httpx.get(f"{address}/readyz", timeout=60).status_code == 200:
                return
        except httpx.TransportError:
            pause(0.05)
    raise SystemExit("the service did not start")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--pause", type=float, default=0.2, help="seconds between two requests of a client")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--save", type=Path, help="a file for all samples, as JSON: a list a quantity")
    given = parser.parse_args()
    sys.exit(soak(given.minutes, given.pause, given.seed, given.save))
