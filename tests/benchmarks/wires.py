"""Wires: a unit's link of 2 kHz and 12 channels, and the latency that the driver adds to a table's demand.

`python -m tests.benchmarks.wires [seconds]`: length of the stream, 60 s by default. Unit and table are processes
of their own, so that processor time is the driver's alone.
"""

import asyncio
import os
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from bench_service.drivers.interface.driver import DriverContext
from bench_service.drivers.interface.registry import driver
from bench_service.drivers.wall_bench_clock import WallBenchClock
from procedures.core.recording import Channel, Quantity
from procedures.core.unit import Unit
from simulators.served.unit_frames import CountFrames

RATE_HZ, CHANNELS = 2000.0, 12
SHARE, LATENCY_MS = 0.20, 5.0
QUESTIONS = 300
RATE_DEG_S = 50.0
"""Rate at which an axis is braked, for an example [deg/s]."""
PREFIX = bytes(8)


def channels() -> tuple[Channel, ...]:
    """Twelve channels: six of increments, six of temperature."""
    inertial = [Channel(f"c{k}", Quantity.ANGLE_INCREMENT, "rad", 1e-6) for k in range(6)]
    return (*inertial, *(Channel(f"t{k}", Quantity.TEMPERATURE, "degC", 0.01) for k in range(6)))


def send_frames(port: int, seconds: float) -> None:
    """Send a stream at its rate to one listener; in a process of its own."""
    frames = CountFrames(channels(), RATE_HZ, CHANNELS)
    counts = list(range(CHANNELS))
    ready = [frames.data(k, counts, 0.0, True) for k in range(65536)]
    with socket.create_server(("127.0.0.1", port)) as server:
        print("ready", flush=True)
        line, _ = server.accept()
        begun, sent, total = time.monotonic(), 0, int((seconds + 5.0) * RATE_HZ)
        with line:
            while sent < total:
                due = min(total, int((time.monotonic() - begun) * RATE_HZ))
                line.sendall(b"".join(ready[k % 65536] for k in range(sent, due)))
                sent = due
                time.sleep(0.005)


def answer_statements(port: int) -> None:
    """Answer each line of an ACUTROL dialog at once; in a process of its own."""
    told = {b"*idn?": b"A, B, C, D", b"*stb?": b"0", b":limit:absolute?": b"60,100,1e4,-360,360,72"}
    with socket.create_server(("127.0.0.1", port)) as server:
        print("ready", flush=True)
        while True:
            line, _ = server.accept()
            line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            buffer = b""
            while data := line.recv(4096):
                buffer += data
                while b"\r\n" in buffer:
                    request, buffer = buffer.split(b"\r\n", 1)
                    word = request.split(b" ")[0]
                    answer = b"12.5" if word.endswith(b"?") else b"OK"
                    line.sendall(PREFIX + told.get(word, answer) + b"\r\n")
            line.close()


def _peer(what: str, *arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tests.benchmarks.wires", what, *map(str, arguments)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    process.stdout.readline()
    return process


def _free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


async def _stream(port: int, folder: Path, seconds: float) -> tuple[int, float, float]:
    """Samples of a recording, processor time and real time that it took."""
    (folder / "frame.toml").write_text(CountFrames(channels(), RATE_HZ, CHANNELS).description())
    made = driver("unit_link", "framed")
    section = made.section.model_validate(
        {"driver": "framed", "address": f"tcp://127.0.0.1:{port}", "frame": "frame.toml"}
    )
    unit = Unit("BENCHMARK", RATE_HZ, channels())
    link = made.open(section, DriverContext("east", WallBenchClock(), folder, unit))
    await link.connect()
    from procedures.core.recording import Station

    samples, cpu, real = 0, time.process_time(), time.monotonic()
    async for block in link.record(seconds, Station(0, "all", temperatures=True)).blocks:
        assert block.shape[1] == CHANNELS
        samples += len(block)
    spent = time.process_time() - cpu, time.monotonic() - real
    link.close()
    return samples, *spent


def _raw_ms(port: int) -> np.ndarray:
    """Round trips of a bare socket [ms]."""
    found: list[float] = []
    with socket.create_connection(("127.0.0.1", port)) as line:
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for _ in range(QUESTIONS):
            begun = time.perf_counter()
            line.sendall(b":demand:position 1,12.50000\r\n")
            line.recv(256)
            found.append(1e3 * (time.perf_counter() - begun))
    return np.array(found)


async def _demands_ms(port: int, folder: Path) -> np.ndarray:
    """Round trips of the driver's demand, without its read-back [ms]."""
    from bench_service.drivers.devices.acutrol_link import AcutrolLink, AcutrolSection

    axis = {"minimum_deg": -360, "maximum_deg": 360, "rate_deg_s": 60, "acceleration_deg_s2": 100}
    section = AcutrolSection.model_validate(
        {
            "driver": "acutrol",
            "address": f"tcp://127.0.0.1:{port}",
            "after_demand_s": 0.0,
            "demand_query": False,
            "outer": {**axis, "number": 1},
            "middle": {**axis, "number": 2},
            "inner": {**axis, "number": 3},
        }
    )
    link = AcutrolLink(section, lambda _event, _more: None)
    await link.identify()
    found: list[float] = []
    for _ in range(QUESTIONS):
        begun = time.perf_counter()
        await link.demand("position", 0, 12.5)
        found.append(1e3 * (time.perf_counter() - begun))
    link.close()
    return np.array(found)


def main() -> int:
    """Measure both and print them beside their limits; 1 if one is beyond."""
    if len(sys.argv) > 2 and sys.argv[1] == "send":
        send_frames(int(sys.argv[2]), float(sys.argv[3]))
        return 0
    if len(sys.argv) > 2 and sys.argv[1] == "answer":
        answer_statements(int(sys.argv[2]))
        return 0
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    print(f"load average {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as folder:
        port = _free_port()
        with _peer("send", port, seconds) as sender:
            samples, cpu, real = asyncio.run(_stream(port, Path(folder), seconds))
            sender.kill()
        port = _free_port()
        with _peer("answer", port) as answerer:
            raw, driven = _raw_ms(port), asyncio.run(_demands_ms(port, Path(folder)))
            answerer.kill()
    share, added = cpu / real, float(np.median(driven) - np.median(raw))
    lost = round(seconds * RATE_HZ) - samples
    print(f"unit link: {RATE_HZ:g} Hz x {CHANNELS} channels for {seconds:g} s: {lost} samples lost (0)")
    print(f"unit link: {share:.1%} of a core (at most {SHARE:.0%})")
    print(
        f"table demand: {np.median(driven):.2f} ms, bare socket {np.median(raw):.2f} ms, added {added:.2f} ms "
        f"(at most {LATENCY_MS:g}); 99 % {np.percentile(driven, 99):.2f} ms, longest {driven.max():.2f} ms"
    )
    median, most = (RATE_DEG_S * 1e-3 * ms for ms in (np.median(driven), driven.max()))
    print(
        f"an axis at {RATE_DEG_S:g} deg/s that is braked by such a statement overshoots by {median:.2f} deg, by "
        f"{most:.2f} deg at most; at a time factor of 10 by {10.0 * median:.1f} and {10.0 * most:.1f} deg"
    )
    return int(lost != 0 or share > SHARE or added > LATENCY_MS)


if __name__ == "__main__":
    sys.exit(main())
