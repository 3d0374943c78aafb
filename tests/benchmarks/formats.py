"""Time and memory of the readers of log files, side by side with each format's own Python reader.

    python -m tests.benchmarks.formats [--rows 100000] [--only mcap]

`--rows` is of a bag; of the other formats six times as many are written.

Each reading is a process of its own that opens a file with six channels and takes all values and one clock. Seconds are
its processor time, which other work on the machine hardly changes: the least of some readings. Memory is
the largest resident size above that before the file was opened. "slope" is the growth of our memory from a file to one
of twice its length, carried on to 2 GB: the reader holds when it is within 300 MB. Exits 1 where a goal is missed.
"""

import argparse
import io
import os
import resource
import struct
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bench_service.formats.logs.registry import FORMATS
from bench_service.formats.logs.table import Log
from bench_service.formats.proposal.choice import chosen_columns, chosen_table

LIMIT_MB = 300.0
CDR_GOAL = 10.0
SHORTEST_BYTES = 50_000_000
"""Size of a file from which the growth of memory is judged; give more --rows for it."""
SLOWER = 1.1
"""A reading may be slower than the peer's by this factor before it counts: caches of a busy machine."""
ROUNDS = 3
Job = Callable[[Path], int]


def ours(form: str) -> Job:
    """Read all blocks of the table and the columns that would be proposed, and its first clock."""

    def job(path: Path) -> int:
        with path.open("rb") as stream:
            log: Log = FORMATS[form].opened(stream, path.name)
            table = chosen_table(log.tables())
            columns, _ = chosen_columns(table)
            names = [c.column for c in table.clocks[:1]] + [c.name for c in columns]
            return sum(len(block[0]) for block in log.rows(table, names))

    return job


def measured(job: Job, path: Path) -> tuple[float, float, int]:
    """Run a job in a process of its own: seconds of processor time, megabytes above idle, rows."""
    here, there = os.pipe()
    child = os.fork()
    if not child:
        code = 1
        try:
            before = resource.getrusage(resource.RUSAGE_SELF)
            rows = job(path)
            after = resource.getrusage(resource.RUSAGE_SELF)
            seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
            grown = (after.ru_maxrss - before.ru_maxrss) / 1000.0
            os.write(there, struct.pack("ddq", seconds, grown, rows))
            code = 0
        finally:
            os._exit(code)
    os.close(there)
    data = b""
    while piece := os.read(here, 64):
        data += piece
    os.close(here)
    os.waitpid(child, 0)
    if len(data) != 24:
        raise RuntimeError(f"the reading of {path.name} failed")
    return struct.unpack("ddq", data)


def motion(rows: int) -> tuple[Any, Any]:
    """Rates and forces, (rows, 3) each, of a fixed seed."""
    rng = np.random.default_rng(7)
    return rng.normal(0.0, 0.01, (rows, 3)), rng.normal([0.0, 0.0, 9.8], 0.02, (rows, 3))


def write_mat(path: Path, rows: int) -> Path:
    """Write a MATLAB file of version 5, packed, as MATLAB does by default."""
    import scipy.io

    rates, forces = motion(rows)
    scipy.io.savemat(path, {"gyro": rates, "acc": forces, "t": np.arange(rows) * 0.005}, do_compression=True)
    return path


def read_mat(path: Path) -> int:
    """Read by scipy."""
    import scipy.io

    return len(scipy.io.loadmat(path, mat_dtype=True)["gyro"])


def write_hdf5(path: Path, rows: int) -> Path:
    """Write an HDF5 file in packed chunks."""
    import h5py

    rates, forces = motion(rows)
    with h5py.File(path, "w") as file:
        for name, values in (("gyro", rates), ("acc", forces)):
            file.create_dataset(name, data=values, chunks=(8192, 3), compression="gzip", compression_opts=1)
        file["time"] = np.arange(rows) * 0.005
    return path


def read_hdf5(path: Path) -> int:
    """Read by h5py, each dataset at once."""
    import h5py

    with h5py.File(path) as file:
        return len(file["gyro"][:]) + 0 * len(file["acc"][:]) + 0 * len(file["time"][:])


def write_tdms(path: Path, rows: int) -> Path:
    """Write a TDMS file in segments of 10 000 rows."""
    import nptdms

    rates, forces = motion(rows)
    columns = {
        f"{kind} {axis}": values[:, i]
        for kind, values in (("gyro", rates), ("acc", forces))
        for i, axis in enumerate("xyz")
    }
    with nptdms.TdmsWriter(path) as writer:
        for start in range(0, rows, 10_000):
            part = slice(start, start + 10_000)
            writer.write_segment(
                [nptdms.ChannelObject("IMU", n, v[part], {"wf_increment": 0.005}) for n, v in columns.items()]
            )
    return path


def read_tdms(path: Path) -> int:
    """Read by npTDMS, whole."""
    import nptdms

    file = nptdms.TdmsFile.read(path)
    return len(file["IMU"]["gyro x"][:])


def _messages(rows: int, store: Any, ros1: bool) -> Any:
    from tests.formats import ros_files

    rates, forces = motion(rows)
    types = store.types
    zeros = np.zeros(9)
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"](0, 0, 0, 1)
    for row in range(rows):
        stamp = types["builtin_interfaces/msg/Time"](1_700_000_000 + row // 200, row % 200 * 5_000_000)
        header = types["std_msgs/msg/Header"]
        stamped = header(row, stamp, "imu") if ros1 else header(stamp, "imu")
        message = types[ros_files.IMU](
            stamped, quaternion, zeros, vector(*rates[row]), zeros, vector(*forces[row]), zeros
        )
        serialised = (
            store.serialize_ros1(message, ros_files.IMU) if ros1 else store.serialize_cdr(message, ros_files.IMU)
        )
        yield 1_700_000_000_000_000_000 + row * 5_000_000, serialised


def write_bag2(plugin: str) -> Callable[[Path, int], Path]:
    """Write a ROS 2 bag by rosbags."""

    def write(path: Path, rows: int) -> Path:
        from rosbags.rosbag2 import StoragePlugin, Writer

        from tests.formats import ros_files

        with Writer(path, version=9, storage_plugin=StoragePlugin[plugin]) as writer:
            imu = writer.add_connection("/imu", ros_files.IMU, typestore=ros_files.ROS2)
            for stamp, data in _messages(rows, ros_files.ROS2, ros1=False):
                writer.write(imu, stamp, data)
        return next(p for p in path.iterdir() if p.suffix in (".db3", ".mcap"))

    return write


def write_bag1(path: Path, rows: int) -> Path:
    """Write a ROS 1 bag by rosbags."""
    from rosbags.rosbag1 import Writer

    from tests.formats import ros_files

    with Writer(path) as writer:
        imu = writer.add_connection("/imu", ros_files.IMU, typestore=ros_files.ROS1)
        for stamp, data in _messages(rows, ros_files.ROS1, ros1=True):
            writer.write(imu, stamp, data)
    return path


def read_bag(path: Path) -> int:
    """Read by rosbags, generic decoding of each message into an array."""
    from rosbags.highlevel import AnyReader

    rows: list[Any] = []
    with AnyReader([path if path.suffix == ".bag" else path.parent]) as reader:
        for connection, _, raw in reader.messages():
            message: Any = reader.deserialize(raw, connection.msgtype)
            gyro, acc, stamp = message.angular_velocity, message.linear_acceleration, message.header.stamp
            rows.append((stamp.sec, stamp.nanosec, gyro.x, gyro.y, gyro.z, acc.x, acc.y, acc.z))
    return len(np.array(rows))


def write_ulog(path: Path, rows: int) -> Path:
    """Write a ULog with one topic."""
    from bench_service.formats.logs.ulog import MAGIC

    rates, forces = motion(rows)
    fields = (
        b"sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;float[3] accelerometer_m_s2;"
    )
    out = io.BytesIO()
    out.write(MAGIC + struct.pack("<BQ", 1, 0) + struct.pack("<HB", 40, ord("B")) + bytes(40))
    out.write(struct.pack("<HB", len(fields), ord("F")) + fields)
    out.write(struct.pack("<HBBH", 18, ord("A"), 0, 0) + b"sensor_combined")
    for row in range(rows):
        out.write(struct.pack("<HBHQ3fI3f", 38, 68, 0, row * 4000, *rates[row], 4000, *forces[row]))
    path.write_bytes(out.getvalue())
    return path


def read_ulog(path: Path) -> int:
    """Read by pyulog."""
    from pyulog import ULog

    return len(ULog(str(path)).data_list[0].data["timestamp"])


def write_novatel(path: Path, rows: int) -> Path:
    """Write RAWIMUSX."""
    from bench_service.formats.logs.novatel import crc

    counts = np.rint(np.hstack(motion(rows)) * 1000).astype(int)
    out = io.BytesIO()
    for row in range(rows):
        body = struct.pack("<BBHdI6i", 0, 11, 2100, 1000 + row * 0.005, 0, *counts[row])
        head = struct.pack("<3sBHHI", b"\xaa\x44\x13", len(body), 1462, 2100, 1_000_000 + row * 5)
        out.write(head + body + struct.pack("<I", crc(head + body)))
    path.write_bytes(out.getvalue())
    return path


def read_novatel(path: Path) -> int:
    """Read by novatel-edie."""
    from novatel_edie import oem

    rows = [
        (m.gps_seconds, m.gyro_x, m.gyro_y, m.gyro_z, m.accel_x, m.accel_y, m.accel_z)
        for m in oem.FileParser(str(path))  # pyright: ignore
    ]
    return len(np.array(rows))


CASES: dict[str, tuple[str, str, Callable[[Path, int], Path], Job]] = {
    "mat5": ("a.mat", "scipy", write_mat, read_mat),
    "hdf5": ("a.h5", "h5py", write_hdf5, read_hdf5),
    "tdms": ("a.tdms", "npTDMS", write_tdms, read_tdms),
    "mcap": ("mcap", "rosbags", write_bag2("MCAP"), read_bag),
    "rosbag2": ("db", "rosbags", write_bag2("SQLITE3"), read_bag),
    "rosbag1": ("a.bag", "rosbags", write_bag1, read_bag),
    "ulog": ("a.ulg", "pyulog", write_ulog, read_ulog),
    "novatel": ("a.gps", "novatel-edie", write_novatel, read_novatel),
}


def cdr_ratio(rows: int) -> float:
    """Time of rosbags' generic decoding of CDR over that of ours, messages in memory."""
    from bench_service.formats.logs.ros.definitions import distribution
    from bench_service.formats.logs.ros.messages import Decoder, Topic
    from tests.formats import ros_files

    messages = [data for _, data in _messages(rows, ros_files.ROS2, ros1=False)]
    topic = Topic("/imu", ros_files.IMU, distribution("a"), cdr=True)
    names = ["header.stamp", *(f"{f}.{a}" for f in ("angular_velocity", "linear_acceleration") for a in "xyz")]
    stamps = np.zeros(rows, np.int64)
    packed = [bytes(m) for m in messages]
    begin = time.perf_counter()
    for start in range(0, rows, 8192):
        part = slice(start, start + 8192)
        list(Decoder(topic, names, "a").decode(packed[part], stamps[part], stamps[part]))
    middle = time.perf_counter()
    for data in messages:
        ros_files.ROS2.deserialize_cdr(data, ros_files.IMU)
    end = time.perf_counter()
    here, there = (middle - begin) / rows * 1e6, (end - middle) / rows * 1e6
    print(f"CDR of Imu: ours {here:.3f} µs, generic {there:.2f} µs a message")
    return (end - middle) / (middle - begin)


def main() -> int:
    """Print the table; return 1 where a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=100_000)
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    missed: list[str] = []
    print("processor seconds for a million samples (a row has six), MB above idle for the whole file")
    print(f"{'format':10}{'ours s':>9}{'peer s':>9}{'ours MB':>9}{'peer MB':>9}{'at 2 GB':>9}  peer")
    for form, (name, peer, write, theirs) in CASES.items():
        if asked.only in ("", form):
            rows = asked.rows * (1 if peer == "rosbags" else 6)
            missed += _case(form, name, peer, write, theirs, rows)
    if asked.only in ("", "mcap"):
        ratio = cdr_ratio(min(asked.rows, 50_000))
        print(f"CDR ratio {ratio:.1f}, goal {CDR_GOAL:g}")
        missed += [f"CDR: {ratio:.1f} times as fast, goal {CDR_GOAL:g}"] if ratio < CDR_GOAL else []
    for words in missed:
        print(f"MISSED {words}")
    return bool(missed)


def _case(form: str, name: str, peer: str, write: Callable[[Path, int], Path], theirs: Job, rows: int) -> list[str]:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "1").mkdir()
        (Path(folder) / "2").mkdir()
        file, longer = write(Path(folder) / "1" / name, rows), write(Path(folder) / "2" / name, 2 * rows)
        seconds, memory, count = min(measured(ours(form), file) for _ in range(ROUNDS))
        _, memory_2, _ = measured(ours(form), longer)
        peer_s, peer_memory, peer_count = min(measured(theirs, file) for _ in range(ROUNDS))
        file_bytes = file.stat().st_size
        at_2_gb = memory_2 + max(0.0, memory_2 - memory) * 2e9 / (longer.stat().st_size - file.stat().st_size)
    if not count == peer_count == rows:
        return [f"{form}: {count} and {peer_count} of {rows} rows"]
    million = 1e6 / (6 * rows)
    print(
        f"{form:10}{seconds * million:9.3f}{peer_s * million:9.3f}{memory:9.1f}{peer_memory:9.1f}{at_2_gb:9.0f}  {peer}"
    )
    found = [f"{form}: slower than {peer}"] if seconds > SLOWER * peer_s else []
    judged = file_bytes >= SHORTEST_BYTES  # before that pieces and pools fill up, which is no growth
    return found + ([f"{form}: {at_2_gb:.0f} MB at 2 GB"] if judged and at_2_gb > LIMIT_MB else [])


if __name__ == "__main__":
    sys.exit(main())
