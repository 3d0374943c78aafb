"""Figures of a service over a soak, and whether memory, descriptors, threads and logs stay level."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil

from tests.soak.slope import Slope, slope

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
        self.wal_mb.append(size_of(folder / "bench.sqlite-wal") / 1e6)
        self.log_kb.append(sum(map(size_of, [*folder.glob("*.log*"), *folder.glob("*.out")])) / 1e3)


def _memory_mb(child: psutil.Process) -> float:
    try:
        return child.memory_info().rss / 1e6
    except psutil.NoSuchProcess:
        return 0.0


def size_of(file: Path) -> int:
    """Size of a file in bytes; 0 where there is none."""
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


def judged_counts(series: Mapping[str, Sequence[int]]) -> list[str]:
    """Print counts by quarter, each by its name; return those that grow."""
    wrong: list[str] = []
    for name, counts in series.items():
        if not counts:
            wrong.append(f"{name}: not determined: there is no sample of the service")
            continue
        quarters = np.array_split(np.array(counts), min(4, len(counts)))
        print(f"{name}: {', '.join(str(int(q.max())) for q in quarters)} at most in each quarter")
        if len(quarters) == 4 and quarters[3].max() > quarters[1].max() + GROWN:
            wrong.append(f"{name} grow: {quarters[1].max()} to {quarters[3].max()}")
    return wrong


def growing(samples: Samples, minutes: float) -> list[str]:
    """Print threads and memory of a short soak; return what grows, and memory whose growth is not determined."""
    wrong = judged_counts({"threads": samples.threads})
    times, memory = np.array(samples.minutes), np.array(samples.memory_mb)
    late = times >= minutes / 4.0
    quarters = [float(q.mean()) for q in np.array_split(memory, 4) if len(q)]
    print(f"memory: {', '.join(f'{q:.1f}' for q in quarters)} MB by quarter, {max(memory, default=0.0):.0f} MB at most")
    try:
        found = slope(times[late], memory[late])
    except ValueError as error:
        wrong.append(f"memory: its growth is not determined: {error}; the last three quarters of a soak count")
        return wrong
    print(f"  over the last {0.75 * minutes:.0f} min: {found} MB")
    if found.low > LEVEL_MB:
        wrong.append(f"memory grows by {found} MB")
    return wrong


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
    wrong += judged_counts({"descriptors": samples.descriptors, "threads": samples.threads})
    print(f"write-ahead log: {max(samples.wal_mb):.1f} MB at most")
    if max(samples.wal_mb) > WAL_MB:
        wrong.append(f"the write-ahead log has {max(samples.wal_mb):.0f} MB")
    per_min = (samples.log_kb[-1] - samples.log_kb[0]) / max(times[-1] - times[0], 1e-9)
    print(f"logs: {samples.log_kb[-1]:.0f} kB, {per_min:.1f} kB a minute")
    if samples.log_kb[-1] > LOGS_KB:
        wrong.append(f"the logs have {samples.log_kb[-1] / 1e3:.0f} MB")
    return wrong
