"""``make profile``: the three heaviest lines of each benchmark, by processor time and by memory.

    python -m tests.benchmarks.heaviest [--tools .venv-profile/bin] [--only static,allan]

Time: py-spy samples the service and its processes 200 times a second while the benchmark's work is done; a sample
counts for the innermost line of our own packages that it was in, and separately for the line it was in itself, wherever
that is. Memory: memray's high-water mark of the service's own process, by the innermost line of ours. It only prints.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.benchmarks.against import load
from tests.benchmarks.measures import ALLAN, POLL_S, STATIC
from tests.benchmarks.process import Service
from tests.benchmarks.revision import HERE, here

RATE_HZ = 200
HEAVIEST = 3
OURS = ("bench_service/", "procedures/", "simulators/")
HIGH_WATER = """
import sys
from collections import Counter
import memray
sizes = Counter()
for found in memray.FileReader(sys.argv[1]).get_high_watermark_allocation_records(merge_threads=True):
    lines = [f"{file}:{line}" for _, file, line in found.stack_trace()]
    ours = [line for line in lines if "site-packages" not in line and any(part in line for part in sys.argv[3:])]
    sizes[(ours or lines or ["outside Python"])[0]] += found.size
print(sum(sizes.values()))
for line, size in sizes.most_common(int(sys.argv[2])):
    print(size, line)
"""


def no_ops(running: Service) -> None:
    """A hundred no-ops, one after another."""
    for _ in range(100):
        running.finish(procedure="no_operation")


def job(procedure: str, parameters: dict[str, object]) -> Callable[[Service], None]:
    """One job, to its end."""

    def work(running: Service) -> None:
        running.finish(POLL_S, procedure=procedure, parameters=parameters)

    return work


SERVICES: dict[str, Callable[[Service], None]] = {
    "start": lambda running: running.finish(procedure="no_operation") and None,
    "no_op": no_ops,
    "calibration": job("calibration_12_orientations", {}),
    "static": job("static_run", STATIC),
    "thermal": job("thermal_cycle", {}),
}
CAMPAIGN = ("-m", "bench_service", "campaign", "run", "thesis_acceptance", "--unit", "SIM-0001", "--seed", "1")
SCRIPTS: dict[str, str | tuple[str, ...]] = {"allan": ALLAN, "campaign": (*CAMPAIGN, "--json")}
"""The text of a script, or the arguments of an interpreter."""


def main() -> int:
    """Profile and print; 1 only where a profiler does not run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tools", type=Path, default=Path(".venv-profile/bin"))
    parser.add_argument("--only", default=",".join((*SERVICES, *SCRIPTS)))
    given = parser.parse_args()
    tools = given.tools.resolve()
    print(f"{here().commit}; {load()}", flush=True)
    for name in given.only.split(","):
        with tempfile.TemporaryDirectory(prefix="bench-profile-") as folder:
            try:
                _by_time(name, tools, Path(folder))
                if name in SERVICES:
                    _by_memory(name, tools, Path(folder))
            except (subprocess.SubprocessError, OSError, AssertionError) as failed:
                print(f"{name}: not profiled: {failed}", file=sys.stderr)
                return 1
    return 0


def _by_time(name: str, tools: Path, folder: Path) -> None:
    file = folder / "stacks.txt"
    spy = (str(tools / "py-spy"), "record", "--subprocesses", "--rate", str(RATE_HZ), "--format", "raw")
    prefix = (*spy, "--output", str(file), "--")
    if name in SERVICES:
        with _under(prefix) as running:
            SERVICES[name](running)
    else:
        environment = {**os.environ, "BENCH_DATABASE_URL": f"sqlite:///{folder}/bench.sqlite"}
        environment |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        quiet, what = subprocess.DEVNULL, SCRIPTS[name]
        if isinstance(what, str):
            script = folder / "script.py"
            script.write_text(what)
            what = (str(script),)
            environment["PYTHONPATH"] = str(HERE)
        subprocess.run(
            [*prefix, str(here().python), *what], env=environment, cwd=HERE, stdout=quiet, stderr=quiet, check=False
        )
    whole, ours, own = stacks(file.read_text())
    print(f"{name}: {whole / RATE_HZ:.1f} s of samples")
    for title, lines in (("of ours", ours), ("any", own)):
        for line, samples in lines.most_common(HEAVIEST):
            print(f"  {title:8} {samples / max(whole, 1):6.1%}  {line}", flush=True)


def _by_memory(name: str, tools: Path, folder: Path) -> None:
    """`SIGTERM` ends the service in order, so that the file is whole."""
    file = folder / "allocations.bin"
    python = tools / "python"
    packages = here().python.parents[1] / "lib" / f"python3.{sys.version_info.minor}" / "site-packages"
    environment = {"PYTHONPATH": os.pathsep.join((str(HERE), str(packages)))}
    prefix = (
        str(python),
        "-m",
        "memray",
        "run",
        "--quiet",
        "--force",
        "--output",
        str(file),
        "-m",
        "bench_service",
        "serve",
    )
    with here().service(whole=prefix, environment=environment) as running:
        SERVICES[name](running)
    said = subprocess.run(
        [str(python), "-c", HIGH_WATER, str(file), str(HEAVIEST), *OURS], text=True, stdout=subprocess.PIPE, check=True
    ).stdout.splitlines()
    print(f"  memory at its greatest: {int(said[0]) / 1e6:.0f} MB allocated")
    for line in said[1:]:
        size, where = line.split(" ", 1)
        print(f"  memory   {int(size) / 1e6:6.1f} MB  {where.removeprefix(str(HERE) + '/')}", flush=True)


@contextmanager
def _under(prefix: tuple[str, ...]) -> Iterator[Service]:
    """The service below a profiler, which writes its file once the service has ended."""
    with here().service(prefix) as running:
        yield running
        for process in running.children():
            if "serve" in process.cmdline():
                process.send_signal(signal.SIGTERM)
        running.process.wait(120)


def stacks(text: str) -> tuple[int, Counter[str], Counter[str]]:
    """Number of samples, and of samples by the innermost line of our packages, and by the line itself.

    `text`: a line a stack, frames ``name (file:line)`` separated by semicolons, the outermost first, and a count.
    """
    whole, ours, own = 0, Counter[str](), Counter[str]()
    for line in text.splitlines():
        stack, _, count = line.rpartition(" ")
        frames = [frame for frame in stack.split(";") if not frame.startswith("process ")] or ["between two lines"]
        whole += int(count)
        own[frames[-1]] += int(count)
        near = [frame for frame in frames if any(part in frame for part in OURS)]
        ours[near[-1] if near else "no line of ours"] += int(count)
    return whole, ours, own


if __name__ == "__main__":
    sys.exit(main())
