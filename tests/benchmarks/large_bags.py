"""Memory of an import of a bag of 2 GB: service and reader together, above what the service takes idle.

    python -m tests.benchmarks.large_bags [--gigabytes 2] [--only mcap]

Each bag is written by rosbags into a temporary folder, described and imported over HTTP as a person would, and removed.
"imu" holds messages of one IMU and nothing else, "camera" images of 0.9 MB among an IMU's messages at 200 Hz. The
resident sets of the service and of all processes that it begins are added up every 20 ms; pages that a fork shares are
counted twice, so the sum is no less than what is taken. Exits 1 where a bag takes more than 300 MB above idle.
"""

import argparse
import json
import struct
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from bench_service.wall_clock import monotonic_s, pause
from tests.benchmarks.process import Service, command, free_port
from tests.formats import ros_files

LIMIT_MB = 300.0
STEP_NS = 5_000_000
BEGIN_NS = 1_700_000_000_000_000_000
IMAGE = "sensor_msgs/msg/Image"
BETWEEN_IMAGES = 7
KINDS = ("imu", "camera")


def _stamped(template: bytes, sec_at: int, row: int) -> bytes:
    """Return a serialised message with the stamp of a row."""
    stamp_ns = BEGIN_NS + row * STEP_NS
    message = bytearray(template)
    struct.pack_into("<II", message, sec_at, stamp_ns // 10**9, stamp_ns % 10**9)
    return bytes(message)


def _image(store: Any) -> Any:
    types = store.types
    header = ros_files.message(store, 0).header
    pixels = np.random.default_rng(7).integers(0, 256, 640 * 480 * 3, dtype=np.uint8)
    return types[IMAGE](header, 480, 640, "rgb8", 0, 640 * 3, pixels)


def _messages(kind: str, size: int, store: Any) -> Iterator[tuple[str, int, bytes]]:
    """Yield type, arrival and bytes of messages, `size` bytes of them in all."""
    ros1 = store is ros_files.ROS1
    serialise: Any = store.serialize_ros1 if ros1 else store.serialize_cdr
    imu = bytes(serialise(ros_files.message(store, 0), ros_files.IMU))
    picture = bytes(serialise(_image(store), IMAGE)) if kind == "camera" else b""
    row = taken = 0
    while taken < size:
        if picture and row % BETWEEN_IMAGES == 0:
            taken += len(picture)
            yield IMAGE, BEGIN_NS + row * STEP_NS, picture
        data = _stamped(imu, 4, row)  # after the sequence number of ROS 1, or the head of CDR
        taken += len(data)
        yield ros_files.IMU, BEGIN_NS + row * STEP_NS + ros_files.LATE_NS, data
        row += 1


def written(form: str, kind: str, folder: Path, size: int) -> Path:
    """Write a bag by rosbags; return its file."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin, Writer

    path = folder / "bag"
    store = ros_files.ROS1 if form == "rosbag1" else ros_files.ROS2
    if form == "rosbag1":
        writer: Any = Writer1(path.with_suffix(".bag"))
    else:
        plugin = StoragePlugin.MCAP if form == "mcap" else StoragePlugin.SQLITE3
        writer = Writer(path, version=9, storage_plugin=plugin)
    with writer:
        topics = {
            name: writer.add_connection(topic, name, typestore=store)
            for name, topic in ((ros_files.IMU, "/imu/data"), (IMAGE, "/camera"))
        }
        for name, stamp, data in _messages(kind, size, store):
            writer.write(topics[name], stamp, data)
    return next(p for p in folder.rglob("*") if p.suffix in (".bag", ".db3", ".mcap"))


class Watched:
    """Sum of the resident sets of a service and its processes, looked at until it is left; `peak_mb` the largest."""

    def __init__(self, running: Service) -> None:
        self._running = running
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)
        self.peak_mb = 0.0

    def _look(self) -> None:
        while not self._ends.wait(0.02):
            self.peak_mb = max(self.peak_mb, sum(self._running.memory_mb().values()))

    def __enter__(self) -> "Watched":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.set()
        self._thread.join()


def _brought_in(running: Service, file: Path) -> tuple[dict[str, Any], float, float]:
    """Describe and import a file; return the recording and the seconds that each took."""
    begin = monotonic_s()
    with file.open("rb") as stream:
        answer = running.client.post(
            "/api/v1/recordings/describe", files={"file": (file.name, stream)}, data={"unit": "BAG-1"}
        )
    answer.raise_for_status()
    middle = monotonic_s()
    description = json.dumps(answer.json()["description"])
    with file.open("rb") as stream:
        answer = running.client.post(
            "/api/v1/recordings", files={"files": (file.name, stream)}, data={"description": description}
        )
    if answer.is_error:
        raise RuntimeError(answer.text)
    return answer.json(), middle - begin, monotonic_s() - middle


def _case(form: str, kind: str, size: int) -> str | None:
    """Measure one bag; return a sentence where it misses the goal."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="large-bag-")))
        file = written(form, kind, folder, size)
        port = free_port()
        environment = {
            "BENCH_DATABASE_URL": f"sqlite:///{folder}/bench.sqlite",
            "BENCH_PORT": str(port),
            "BENCH_MAX_IMPORT_MB": str(2 * size // 1_000_000 + 100),
        }
        running = stack.enter_context(
            command([sys.executable, "-m", "bench_service", "serve"], port, environment, folder)
        )
        while running.client.get("/readyz").status_code != 200:
            pause(0.05)
        running.client.post(  # the reader's host is there before, as in a service that is in use
            "/api/v1/recordings/describe", files={"file": ("a.csv", b"t,gyro_x\n0,1\n1,2\n2,3\n")}, data={"unit": "A"}
        )
        pause(1.0)
        idle = sum(running.memory_mb().values())
        with Watched(running) as watched:
            recording, described_s, imported_s = _brought_in(running, file)
        above = watched.peak_mb - idle
        print(
            f"{form:8} {kind:7} {file.stat().st_size / 1e9:5.2f} GB {recording['count']:9d} samples  "
            f"describe {described_s:6.1f} s  import {imported_s:6.1f} s  idle {idle:5.0f} MB  above {above:5.0f} MB",
            flush=True,
        )
    return f"{form} {kind}: {above:.0f} MB above idle" if above > LIMIT_MB else None


def main() -> int:
    """Print a line for each bag; return 1 where a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--gigabytes", type=float, default=2.0)
    parser.add_argument("--only", default="", help="mcap, rosbag2 or rosbag1")
    parser.add_argument("--kind", default="", choices=("", *KINDS))
    asked = parser.parse_args()
    size = int(asked.gigabytes * 1e9)
    missed = [
        words
        for form in ("mcap", "rosbag2", "rosbag1")
        for kind in KINDS
        if asked.only in ("", form) and asked.kind in ("", kind) and (words := _case(form, kind, size))
    ]
    for words in missed:
        print(f"MISSED {words}: at most {LIMIT_MB:g} MB are asked for")
    return bool(missed)


if __name__ == "__main__":
    sys.exit(main())
