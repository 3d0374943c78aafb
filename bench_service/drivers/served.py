"""A bench file's devices as simulators that listen on the file's addresses, with one simulated world behind them."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench_service.drivers.bench_file.document import BenchFile
from bench_service.drivers.interface.address import Address
from bench_service.drivers.served_unit_file import write_unit_file
from bench_service.model.errors import Misconfigured
from bench_service.wall_clock import monotonic_s, pause_async
from simulators.served.bench import LANGUAGES, ServedBench, ServedConfig, ServedDevice
from simulators.served.faults import Fault
from simulators.served.unit_frames import CountFrames
from simulators.truth import declared_unit, default_bench, default_unit, load_bench, load_unit
from simulators.world import WorldConfig

if TYPE_CHECKING:
    from bench_service.drivers.interface.driver import Kind


def served_bench(file: BenchFile, faults: Path | None = None) -> ServedBench:
    """Make the world of a bench file's simulation and its ports; nothing is open yet.

    A frame's file and a unit's file that the bench file names and does not have are written. Devices that the file
    simulates within the driving process are not served. Raises `Misconfigured` for a driver whose protocol is not
    served, a truth or a plan of faults that cannot be used, and a frame's file of other frames.

    `faults`: file of a plan of faults, None for none.
    """
    devices: dict[str, ServedDevice] = {
        kind: _device(kind, section) for kind, section in file.real().items() if kind != "environment"
    }
    if not devices:
        raise Misconfigured(f"{file.path}: no device has an address, so there is nothing to serve")
    person = file.rest.operator.address
    if person is not None:
        devices["operator"] = ServedDevice("person", person.host, person.port)
    try:
        config = ServedConfig(_world(file, "chamber" in devices), devices, file.time_factor, _plan(faults))
        bench = ServedBench(config, monotonic_s, pause_async)
    except (ValueError, TypeError, OSError) as error:
        raise Misconfigured(f"{file.path}: {error}") from error
    _agree_on_frames(file, bench)
    write_unit_file(file.folder, declared_unit(bench.config.world.unit))
    return bench


def _device(kind: "Kind", section: Any) -> ServedDevice:
    language: str = section.driver
    if language not in LANGUAGES.get(kind, ()):
        spoken = ", ".join(LANGUAGES.get(kind, ())) or "none"
        raise Misconfigured(f"{kind}.driver = {language!r}: this protocol is not served; of a {kind} there is {spoken}")
    address: Address = section.address
    if address.scheme == "serial" or (address.scheme == "udp" and language != "framed"):
        raise Misconfigured(f"{kind}.address = {address}: simulators serve on tcp, and a framed unit on udp")
    return ServedDevice(language, address.host, address.port, address.scheme == "udp", _options(kind, section))


def _options(kind: "Kind", section: Any) -> dict[str, Any]:
    if kind != "turntable":
        return {}
    endings = {"crlf": b"\r\n", "lf": b"\n", "cr": b"\r"}
    return {
        "numbers": (section.outer.number, section.middle.number, section.inner.number),
        "prefix_bytes": section.reply_prefix_bytes,
        "ending": endings[section.reply_ending],
    }


def _world(file: BenchFile, thermal: bool) -> WorldConfig:
    simulation = file.rest.simulation
    unit = default_unit() if simulation.unit_truth is None else load_unit(file.folder / simulation.unit_truth)
    bench = default_bench() if simulation.bench_truth is None else load_bench(file.folder / simulation.bench_truth)
    return WorldConfig(unit, bench, simulation.seed, thermal=thermal)


def _plan(path: Path | None) -> tuple[Fault, ...]:
    """Read a plan of faults: tables ``[[fault]]``. Raises `Misconfigured` naming the file."""
    if path is None:
        return ()
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
        if unknown := sorted(set(document) - {"fault"}):
            raise ValueError(f"{unknown[0]} is unknown; there is [[fault]]")
        return tuple(Fault.of(table) for table in document.get("fault", ()))
    except (OSError, ValueError, TypeError) as error:
        raise Misconfigured(f"{path}: {error}") from error


def _agree_on_frames(file: BenchFile, bench: ServedBench) -> None:
    """Write the description of the served frames where the file names one that does not exist; else compare it."""
    section: Any = file.devices.get("unit_link")
    if getattr(section, "driver", "") != "framed":
        return
    frames = bench.frames_of("unit_link")
    assert isinstance(frames, CountFrames)
    path = file.folder / section.frame
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(frames.description(), encoding="utf-8")
    elif tomllib.loads(path.read_text(encoding="utf-8")) != tomllib.loads(frames.description()):
        raise Misconfigured(
            f"{path} describes other frames than the simulated unit sends: delete it, and it is written again"
        )


async def serve(bench: ServedBench, ended: Callable[[], bool], say: Callable[[str], object], look_s: float) -> None:
    """Open the ports, let the world continue until `ended`, close. Raises `Misconfigured` for a port that is taken."""
    try:
        numbers = await bench.open()
    except OSError as error:
        await bench.close()
        raise Misconfigured(f"a port cannot be opened: {error.strerror or error}") from error
    for kind, number in numbers.items():
        device = bench.config.devices[kind]
        way = "sends to" if device.datagrams else "serves on"
        say(f"{kind}: {device.language} {way} {device.host}:{number}")
    say(f"time factor {bench.config.factor:g}, seed {bench.config.world.seed}; not a real device among them")
    try:
        while not ended():
            await pause_async(look_s)
            bench.check()
    finally:
        await bench.close()
        if bench.pace.behind_s > 0.0:
            say(f"{bench.pace.behind_s:.1f} s of bench time were given up: this machine is too slow for the factor")
