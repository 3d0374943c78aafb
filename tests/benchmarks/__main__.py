"""``make bench``: every budget measured, printed beside its limit and beside a peer of the same run.

Machines are shared and noisy: medians of several rounds, and ratios. Nothing here fails a test; a budget that is
missed is printed as such, and the exit code says whether any was.
"""

import platform
import statistics
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from bench_service.wall_clock import monotonic_s
from tests.benchmarks.process import Service, command, free_port, service

PEER_APPLICATION = """
import sys, uvicorn
from fastapi import FastAPI
app = FastAPI()
@app.get("/healthz")
def healthz(): return {}
uvicorn.run(app, port=int(sys.argv[1]), log_level="error")
"""


@dataclass(frozen=True)
class Row:
    """One measured budget."""

    what: str
    measured: float
    budget: float
    unit: str
    peer: str

    @property
    def kept(self) -> bool:
        return self.measured <= self.budget


def median_s(rounds: int, work: Callable[[], object]) -> float:
    """Median wall time of some rounds [s]."""
    times: list[float] = []
    for _ in range(rounds):
        begun = monotonic_s()
        work()
        times.append(monotonic_s() - begun)
    return statistics.median(times)


def start() -> Iterator[Row]:
    """From exec to the first 200: on an empty database, on one that exists, and a bare FastAPI application."""
    empty: list[float] = []
    again: list[float] = []
    bare: list[float] = []
    for _ in range(5):
        with tempfile.TemporaryDirectory(prefix="bench-") as folder:
            url = f"sqlite:///{folder}/bench.sqlite"
            for into in (empty, again):
                with service(url) as running:
                    into.append(running.start_s)
        port = free_port()
        with command([sys.executable, "-c", PEER_APPLICATION, str(port)], port, {}) as running:
            bare.append(running.start_s)
    peer = statistics.median(bare)
    for what, times in (("start to first 200, empty database", empty), ("start to first 200, again", again)):
        middle = statistics.median(times)
        yield Row(what, middle, 1.5, "s", f"bare FastAPI {peer:.2f} s, ratio {middle / peer:.2f}")


def jobs(running: Service) -> Iterator[Row]:
    """Submit to finished, as a client sees it; the peer is the service's own answer to a request that does nothing."""
    running.finish(procedure="no_operation")
    no_op = median_s(50, lambda: running.finish(procedure="no_operation"))
    ping = median_s(50, lambda: running.client.get("/healthz"))
    yield Row("no-op job, p50 of 50", no_op * 1e3, 150, "ms", f"GET /healthz {ping * 1e3:.1f} ms")
    body = {"procedure": "calibration_12_orientations"}
    finished: list[dict] = []
    calibration = median_s(5, lambda: finished.append(running.finish(**body)))
    bench_s = finished[0]["duration_s"]
    yield Row(
        "calibration in 12 orientations",
        calibration,
        5,
        "s",
        f"{bench_s:.0f} s of bench time, 1/{bench_s / calibration:.0f}",
    )
    recordings = running.client.get("/api/v1/recordings", params={"job": finished[0]["id"]}).json()["items"]
    samples = sum(r["count"] * len(r["channels"]) for r in recordings)
    stored = sum(r["stored_bytes"] for r in recordings) / samples
    yield Row("stored bytes a sample", stored, 2, "B", f"int32 takes 4 B, ratio {stored / 4:.2f}")


def slices(running: Service) -> Iterator[Row]:
    """One minute out of six hours, over HTTP; the peer reads the same rows of one Parquet file on disk."""
    dwell_s = 6 * 3600.0
    # Four orientations determine the linear model; only the first recording is read.
    poses = [[0, -90], [0, 90], [90, 0], [0, 0]]
    parameters = {"orientations": poses, "dwell_s": dwell_s, "scalar_check": False}
    job = running.finish(procedure="calibration_12_orientations", parameters=parameters)
    memory = running.peak_memory_mb()
    recording = running.client.get("/api/v1/recordings", params={"job": job["id"]}).json()["items"][0]["id"]
    path = f"/api/v1/recordings/{recording}/data"

    def minute(start_s: float = 3 * 3600.0) -> bytes:
        query = {"format": "arrow", "start_s": start_s, "stop_s": start_s + 60.0}
        return running.client.get(path, params=query).content

    ours = median_s(20, minute)
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        file = Path(folder) / "whole.parquet"
        whole = running.client.get(path, params={"format": "arrow"}).content
        pq.write_table(pa.ipc.open_stream(whole).read_all(), file, row_group_size=24_000)
        theirs = median_s(20, lambda: pq.ParquetFile(file).read_row_groups([180]))
    yield Row("1 min out of 6 h over HTTP", ours * 1e3, 20, "ms", f"Parquet row group on disk {theirs * 1e3:.1f} ms")
    yield Row("peak memory, 24 h of recordings", memory, 500, "MB", "207 M samples")


def main() -> int:
    """Measure, print, and say whether every budget is kept."""
    print(f"{platform.machine()}, Python {platform.python_version()}; medians; the machine may be shared", flush=True)
    rows = list(_printed(start()))
    with service() as running:
        rows += _printed(jobs(running))
        rows += _printed(slices(running))
    return 0 if all(row.kept for row in rows) else 1


def _printed(rows: Iterator[Row]) -> Iterator[Row]:
    for row in rows:
        mark = "ok  " if row.kept else "MISS"
        print(
            f"{mark} {row.what:36} {row.measured:9.3f} {row.unit:3} budget {row.budget:g} {row.unit}; {row.peer}",
            flush=True,
        )
        yield row


if __name__ == "__main__":
    sys.exit(main())
