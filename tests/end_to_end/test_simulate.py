"""`bench simulate`: a bench file's devices served as simulators, and driven over their wires by the same file."""

import asyncio
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from bench_service.drivers.bench_file.document import read_bench_file
from bench_service.drivers.bench_file.unit_files import read_units
from bench_service.drivers.interface.driver import DriverContext
from bench_service.drivers.interface.registry import driver
from bench_service.drivers.served import served_bench
from bench_service.drivers.wall_bench_clock import WallBenchClock
from bench_service.model.errors import Misconfigured
from procedures.core.table_angles import TableAngles
from simulators.truth import declared_unit, default_unit

FACTOR = 40.0
AXIS = "rate_deg_s = 60, acceleration_deg_s2 = 100"


def _free_ports(number: int) -> list[int]:
    taken = [socket.socket() for _ in range(number)]
    for line in taken:
        line.bind(("127.0.0.1", 0))
    ports = [line.getsockname()[1] for line in taken]
    for line in taken:
        line.close()
    return ports


def _bench_file(folder: Path, **replaced: str) -> Path:
    table, chamber, supply, unit = _free_ports(4)
    text = f"""
[bench]
id = "served"
[site]
latitude_deg = 50.45
gravity_m_s2 = 9.810553
[simulation]
seed = 7
time_factor = {FACTOR}
[turntable]
driver = "acutrol"
address = "tcp://127.0.0.1:{table}"
after_demand_s = 0.0
outer = {{ number = 3, minimum_deg = -360, maximum_deg = 360, {AXIS}, continuous = true }}
middle = {{ number = 2, minimum_deg = -190, maximum_deg = 190, {AXIS} }}
inner = {{ number = 1, minimum_deg = -400, maximum_deg = 400, {AXIS} }}
[chamber]
driver = "simserv"
address = "tcp://127.0.0.1:{chamber}"
after_set_s = 0.0
limits = {{ minimum_c = -60, maximum_c = 85, ramp_c_min = 3, ambient_c = 22 }}
[supply]
driver = "scpi"
address = "tcp://127.0.0.1:{supply}"
limits = {{ maximum_v = 36, maximum_a = 5, nominal_v = 28, nominal_a = 3 }}
[unit_link]
driver = "framed"
address = "tcp://127.0.0.1:{unit}"
frame = "frames/unit.toml"
"""
    for old, new in replaced.items():
        text = text.replace(f'driver = "{old}"', f'driver = "{new}"')
    path = folder / "sim.toml"
    path.write_text(text)
    return path


@contextmanager
def _simulated(path: Path, *more: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "bench_service", "simulate", "--bench-file", str(path), *more]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            for line in process.stdout:
                if "time factor" in line:
                    break
            yield process
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(20.0)


def test_a_bench_that_is_served_is_driven_by_the_same_file(tmp_path: Path) -> None:
    path = _bench_file(tmp_path)

    async def scene() -> None:
        file, clock = read_bench_file(path), WallBenchClock(factor=FACTOR)
        (unit,) = read_units(tmp_path / "units")
        context = DriverContext("served", clock, tmp_path, unit)
        devices = {kind: driver(kind, s.driver).open(s, context) for kind, s in file.devices.items()}
        supply, table, link = devices["supply"], devices["turntable"], devices["unit_link"]
        await supply.switch_on()
        await devices["chamber"].command(30.0, 2.0)
        await table.move_to(TableAngles(0.0, 0.0, 90.0))
        samples = [len(block) async for block in link.record(4.0).blocks]
        assert sum(samples) == 1600
        reading = await table.read()
        assert reading.angles.inner_deg == pytest.approx(90.0, abs=1e-3)
        assert (await devices["chamber"].read()).target_c == pytest.approx(30.0)
        for device in devices.values():
            if hasattr(device, "make_safe"):
                await device.make_safe()
        assert not (await supply.read()).on
        for device in devices.values():
            device.close()

    with _simulated(path) as process:
        asyncio.run(scene())
    assert process.returncode == 0
    (unit,) = read_units(tmp_path / "units")
    declared = declared_unit(default_unit())
    assert (unit.serial, unit.channels, unit.sample_rate_hz) == (
        declared.serial,
        declared.channels,
        declared.sample_rate_hz,
    )


def test_the_person_at_an_operators_address_is_served(tmp_path: Path) -> None:
    path = _bench_file(tmp_path)
    path.write_text(f'{path.read_text()}\n[operator]\naddress = "tcp://127.0.0.1:7040"\n')
    device = served_bench(read_bench_file(path)).config.devices["operator"]
    assert (device.language, device.host, device.port) == ("person", "127.0.0.1", 7040)


def test_what_cannot_be_served_is_named(tmp_path: Path) -> None:
    path = _bench_file(tmp_path)
    plan = tmp_path / "plan.toml"
    plan.write_text('[[fault]]\ndevice = "chamber"\nkind = "sloww"\n')
    with pytest.raises(Misconfigured, match=r"plan\.toml: fault\.kind = 'sloww' is none of slow, half"):
        served_bench(read_bench_file(path), plan)
    (tmp_path / "frames").mkdir()
    (tmp_path / "frames" / "unit.toml").write_text('name = "another"\n')
    with pytest.raises(Misconfigured, match="describes other frames than the simulated unit sends"):
        served_bench(read_bench_file(path))


def test_a_port_that_is_taken_is_named(tmp_path: Path) -> None:
    path = _bench_file(tmp_path)
    address = read_bench_file(path).devices["supply"].address  # type: ignore[attr-defined]
    with socket.create_server(("127.0.0.1", address.port)):
        command = [sys.executable, "-m", "bench_service", "simulate", "--bench-file", str(path)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60.0, check=False)
    assert done.returncode == 2
    assert "a port cannot be opened: " in done.stderr
