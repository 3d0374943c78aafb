"""Large files that small ones unpack to, or without lines, end or bounds; and what each costs a service."""

import gzip
import io
import json
import os
import select
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Thread

import httpx
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from bench_service.wall_clock import monotonic_s, pause
from tests.benchmarks.process import Service

MB = 1_000_000
CHANNEL = {"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "rad/s"}
DESCRIPTION = {"unit": "BOMB-1", "rate_hz": 100.0, "channels": [CHANNEL]}
POLL_S = 0.02
PRESS_S = 0.1
QUIET_S = 2.0
MOST_SETTLING = 60


def _zipped(piece: bytes, times: int, head: bytes = b"") -> bytes:
    sink = io.BytesIO()
    with gzip.GzipFile(fileobj=sink, mode="wb", compresslevel=1) as out:
        out.write(head)
        for _ in range(times):
            out.write(piece)
    return sink.getvalue()


def _parquet(rows: int, page_bytes: int, groups: int = 1, columns: int = 1) -> bytes:
    zeros = np.zeros(rows // groups)
    table = pa.table({"x" if i == 0 else f"x{i}": zeros for i in range(columns)})
    sink = io.BytesIO()
    with pq.ParquetWriter(
        sink, table.schema, compression="zstd", use_dictionary=False, data_page_size=page_bytes, write_statistics=False
    ) as writer:
        for _ in range(groups):
            writer.write_table(table, row_group_size=rows)
    return sink.getvalue()


def _arrow(rows: int) -> bytes:
    table = pa.table({"x": np.zeros(rows)})
    sink = io.BytesIO()
    with pa.ipc.new_file(sink, table.schema, options=pa.ipc.IpcWriteOptions(compression="zstd")) as writer:
        writer.write_table(table)
    return sink.getvalue()


def _many_columns(count: int) -> bytes:
    names = [f"c{i}" for i in range(count)]
    sink = io.BytesIO()
    empty = np.zeros(1)
    with pa.ipc.new_file(sink, pa.schema([(name, pa.float64()) for name in names])) as writer:
        writer.write_batch(pa.record_batch([pa.array(empty)] * count, names=names))
    return sink.getvalue()


def _noise(megabytes: int) -> bytes:
    return np.random.Generator(np.random.PCG64(1)).bytes(megabytes * MB)


def _honest(megabytes: int) -> bytes:
    """An ordinary table of that size."""
    rows = np.random.Generator(np.random.PCG64(2)).normal(0.0, 1.0, 100_000)
    piece = "".join(f"{v:.6f},{-v:.6f},{2 * v:.6f}\n" for v in rows).encode()
    return b"x,y,z\n" + piece * (megabytes * MB // len(piece))


@dataclass(frozen=True)
class Bomb:
    """A file, and what is different in its description."""

    make: Callable[[], bytes]
    description: dict[str, object]


WHITESPACE = {"delimiter": "whitespace", "header": False, "channels": [{**CHANNEL, "column": 0}]}
CLOCKED = {"rate_hz": None, "time_column": "t", "time_unit": "clock"}
BOMBS: dict[str, Bomb] = {
    "40 kB of blanks in a line": Bomb(lambda: b"1" + b" " * 40_000 + b"2\n", WHITESPACE),
    "100 MB of blanks": Bomb(lambda: b"1" + b" " * (100 * MB) + b"2\n", WHITESPACE),
    "lines of 200 kB of blanks, 100 MB": Bomb(lambda: (b"1" + b" \t" * 100_000 + b"2\n") * 500, WHITESPACE),
    "gzip of 2 GB without a line": Bomb(lambda: _zipped(b"x" * MB, 2000), {}),
    "gzip of 6 GB in lines": Bomb(lambda: _zipped(b"0\n" * (MB // 2), 6000, b"x\n"), {}),
    "gzip of 2 GB after a good head": Bomb(lambda: _zipped(b"0" * MB, 2000, b"x\n1\n2\n"), {}),
    "100 MB of noise": Bomb(lambda: _noise(100), {}),
    "100 MB of noise, gzipped": Bomb(lambda: b"\x1f\x8b\x08\x00" + _noise(99), {}),
    "100 MB of quotes": Bomb(lambda: b"x,y\n" + b'"' * (100 * MB), {}),
    "500,000 names, text": Bomb(lambda: ",".join(f"c{i}" for i in range(500_000)).encode() + b"\n1\n", {}),
    "500,000 columns, Arrow": Bomb(lambda: _many_columns(500_000), {}),
    "Parquet of 2 GB of zeros": Bomb(lambda: _parquet(250_000_000, MB, 25), {}),
    "Parquet with pages without a bound": Bomb(lambda: _parquet(90_000_000, 2000 * MB), {}),
    "Parquet of 64 columns of zeros": Bomb(lambda: _parquet(1_500_000, MB, 1, 64), {}),
    "Arrow with a batch of 800 MB": Bomb(lambda: _arrow(100_000_000), {}),
    "a gap of a million years": Bomb(lambda: b"t,x\n0,1\n1,1\n2,1\n3e13,1\n", {"time_column": "t", "gaps": "mark"}),
    "100 MB of falling time": Bomb(
        lambda: b"t,x\n" + b"9,1\n1,1\n" * 12_500_000, {"time_column": "t", "unwrap_clock": True}
    ),
    "100 MB of the text of a clock": Bomb(lambda: b"t,x\n" + b"00:00:01.18,1\n" * 7_000_000, CLOCKED),
    "100 MB of an ordinary table": Bomb(lambda: _honest(100), {}),
    "100 MB of an ordinary table, 3 channels": Bomb(
        lambda: _honest(100), {"channels": [{**CHANNEL, "name": f"gyro_{a}", "column": a} for a in "xyz"]}
    ),
}


@dataclass(frozen=True)
class Cost:
    """Time, memory and delay that an import cost the service."""

    sent_mb: float
    status: int
    time_s: float
    memory_mb: float
    """Most of all its processes together above idle, see `memory_mb`."""
    delay_s: float
    """The longest answer of /healthz meanwhile."""
    quiet_s: float
    """The longest one in `QUIET_S` before: what the machine itself makes of it."""
    stop_s: float
    """The longest answer to a stop meanwhile, with the wait for the safe bench and the database."""
    stop_quiet_s: float
    words: str

    @property
    def late_s(self) -> float:
        """Delay of /healthz or of the stop, whichever is longer, beyond what it takes in quiet [s]."""
        return max(self.delay_s - self.quiet_s, self.stop_s - self.stop_quiet_s)


def measured(service: Service, bomb: Bomb, data: bytes) -> Cost:
    """Send a file to a service that runs, watching its memory and how soon it answers."""
    small = {"files": [("files", ("a.csv", b"x\n1\n2\n"))], "data": {"description": json.dumps(DESCRIPTION)}}
    service.client.post("/api/v1/recordings", **small).raise_for_status()  # the reader's host is there when idle
    _settle(service.process.pid)
    idle = memory_mb(service.process.pid)
    description = {**DESCRIPTION, **bomb.description}
    with (
        tempfile.TemporaryFile() as file,
        httpx.Client(base_url=service.client.base_url, timeout=600) as fresh,  # the other one may have been idle long
        _watching(service) as seen,
    ):
        file.write(data)
        file.seek(0)
        pause(QUIET_S)
        begun = monotonic_s()
        answer = fresh.post(
            "/api/v1/recordings", files=[("files", ("a", file))], data={"description": json.dumps(description)}
        )
        took_s = monotonic_s() - begun
    words = "" if answer.status_code == 201 else answer.json()["detail"][:100]
    delays = (seen[name] for name in ("delay_s", "quiet_s", "stop_s", "stop_quiet_s"))
    return Cost(len(data) / MB, answer.status_code, took_s, seen["memory_mb"] - idle, *delays, words)


def _settle(pid: int) -> None:
    """Wait until a service that was begun has loaded what it loads beside its first answers."""
    for _ in range(MOST_SETTLING):
        before = _busy_s(pid)
        pause(1.0)
        if _busy_s(pid) - before < 0.1:
            return


def _busy_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def _watching(service: Service) -> Generator[dict[str, float]]:
    """Watch from a process of its own, which waits for no lock of this one; filled at the end of the block."""
    found: dict[str, float] = {}
    command = [sys.executable, "-m", __name__, str(service.client.base_url), str(service.process.pid)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as watching:
        assert watching.stdin is not None
        assert watching.stdout is not None
        assert watching.stdout.readline() == b"watching\n"
        yield found
        watching.stdin.close()
        found.update(json.loads(watching.stdout.read()))


@dataclass
class _Longest:
    """The longest answers in the quiet time before the import, and since."""

    begun_s: float
    quiet_s: float = 0.0
    later_s: float = 0.0

    def take(self, asked_s: float) -> None:
        """Take an answer that has just come."""
        took_s = monotonic_s() - asked_s
        if asked_s - self.begun_s < QUIET_S:
            self.quiet_s = max(self.quiet_s, took_s)
        else:
            self.later_s = max(self.later_s, took_s)


def _watch(url: str, pid: int) -> None:
    """Ask for /healthz, press the stop and look at the memory until the standard input ends; print what was longest."""
    most, ending = 0.0, Event()
    with httpx.Client(base_url=url, timeout=60) as client:
        client.get("/healthz").raise_for_status()
        _press(client, None)
        health, stops = _Longest(monotonic_s()), _Longest(monotonic_s())
        pressing = Thread(target=_press_again, args=(url, stops, ending))
        pressing.start()
        print("watching", flush=True)
        while not select.select([sys.stdin], [], [], POLL_S)[0]:
            asked_s = monotonic_s()
            client.get("/healthz").raise_for_status()
            health.take(asked_s)
            most = max(most, memory_mb(pid))
    ending.set()
    pressing.join()
    found = {"delay_s": health.later_s, "quiet_s": health.quiet_s}
    print(json.dumps({"memory_mb": most, **found, "stop_s": stops.later_s, "stop_quiet_s": stops.quiet_s}))


def _press_again(url: str, longest: _Longest, ending: Event) -> None:
    with httpx.Client(base_url=url, timeout=60) as client:
        while not ending.wait(PRESS_S):
            _press(client, longest)


def _press(client: httpx.Client, longest: _Longest | None) -> None:
    """Press the stop, and release it again without a clock."""
    asked_s = monotonic_s()
    answer = client.post("/api/v1/benches/sim/stop", json={"reason": "an import", "by": "test"}).raise_for_status()
    if longest is not None:
        longest.take(asked_s)
    path = f"/api/v1/benches/sim/stops/{answer.json()['stop']}/release"
    while client.post(path, json={"by": "test", "remark": "none"}).status_code in (404, 409):
        pause(POLL_S)  # the database does not have it yet, or the bench is being made safe


def memory_mb(root: int) -> float:
    """Memory of a process and all that it began, without the files that are mapped into it.

    What a child shares with its parent since the fork is counted twice: an upper bound. The sum that counts it once
    (smaps_rollup) holds a lock of the process that is watched, and so delays it.
    """
    return sum(_anonymous_mb(pid) for pid in _family(root))


def _anonymous_mb(pid: int) -> float:
    try:
        resident, shared = Path(f"/proc/{pid}/statm").read_text().split()[1:3]
    except (OSError, ValueError):
        return 0.0
    return (int(resident) - int(shared)) * os.sysconf("SC_PAGE_SIZE") / MB


def _family(root: int) -> list[int]:
    """A process, its children and theirs."""
    parents: dict[int, list[int]] = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                status = Path(f"/proc/{entry}/stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            parents.setdefault(int(status[1]), []).append(int(entry))
    found, waiting = [], [root]
    while waiting:
        found.append(waiting.pop())
        waiting += parents.get(found[-1], [])
    return found


if __name__ == "__main__":
    _watch(sys.argv[1], int(sys.argv[2]))
