"""A soak: mixed load on one service for a stated time, and whether memory, descriptors, threads and logs stay level.

`python -m tests.soak --minutes 60`; `make soak MINUTES=60`. Exit code 0: level, 1: something grows or failed.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import httpx
import psutil

from bench_service.wall_clock import monotonic_s, pause
from tests.benchmarks.process import free_port
from tests.soak.level import Samples, judge, size_of
from tests.soak.load import Load

EVERY_S = 2.0
"""Interval between two samples [s]."""


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
            database_mb = size_of(folder / "bench.sqlite") / 1e6
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
