"""A laboratory's own devices and drivers for tests: each device a TCP server of JSON lines, with faults to order."""

import asyncio
import json
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from bench_service.drivers.interface.driver import Bound, DeviceDriver, DriverContext, Found, Kind
from bench_service.drivers.interface.sections import WireChamber, WireSupply, WireTurntable
from procedures.bench.chamber import ChamberLimits, ChamberReading
from procedures.bench.device import DeviceIdentity, StatusWord
from procedures.bench.errors import Disconnected, OutOfRange
from procedures.bench.supply import SupplyLimits, SupplyReading
from procedures.bench.turntable import NO_TRACE, EncoderTrace, TableReading
from procedures.core.constant_rate import ConstantRate
from procedures.core.sinusoid import Sinusoid
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn


@dataclass
class LineDevice:
    """State of a served device, its faults, and every request that it was asked."""

    state: dict[str, Any]
    port: int = 0
    silent: bool = False
    late_s: float = 0.0
    asked: list[str] = field(default_factory=list)

    def demands(self) -> list[str]:
        """The demands among the requests."""
        return [verb for verb in self.asked if verb not in ("identify", "read")]

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        verb = request["verb"]
        self.asked.append(verb)
        if verb == "identify":
            return self.state["identity"]
        self.state |= {k: v for k, v in request.items() if k != "verb"}
        return self.state


@contextmanager
def served(*devices: LineDevice) -> Generator[None]:
    """Serve devices on ports of their own, in one thread."""
    loop = asyncio.new_event_loop()
    ready, over = threading.Event(), asyncio.Event()

    async def serve() -> None:
        servers = [await asyncio.start_server(_client(device), "127.0.0.1", 0) for device in devices]
        for device, server in zip(devices, servers, strict=True):
            device.port = server.sockets[0].getsockname()[1]
        ready.set()
        await over.wait()
        for server in servers:
            server.close()

    thread = threading.Thread(target=lambda: loop.run_until_complete(serve()), daemon=True)
    thread.start()
    assert ready.wait(30.0)
    try:
        yield
    finally:
        loop.call_soon_threadsafe(over.set)
        thread.join(30.0)
        for task in asyncio.all_tasks(loop):
            task.cancel()
        loop.run_until_complete(asyncio.sleep(0.05))
        loop.close()


def _client(device: LineDevice) -> Callable[[asyncio.StreamReader, asyncio.StreamWriter], Any]:
    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while line := await reader.readline():
                answer = device.answer(json.loads(line))
                while device.silent:
                    await asyncio.sleep(0.02)
                await asyncio.sleep(device.late_s)
                writer.write(json.dumps(answer).encode() + b"\n")
        except (ConnectionError, asyncio.CancelledError):
            pass
        finally:
            writer.close()

    return talk


class _Line:
    """One link: a request at a time; a link whose answer did not come is dropped, so no late answer is taken."""

    def __init__(self, section: Any, context: DriverContext) -> None:
        self.section, self.context = section, context
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None
        self._turn = asyncio.Lock()
        self._loop: asyncio.AbstractEventLoop | None = None

    async def ask(self, verb: str, **more: Any) -> dict[str, Any]:
        async with self._turn:
            try:
                if self._streams is None:
                    self._loop = asyncio.get_running_loop()
                    async with asyncio.timeout(self.section.connect_s):
                        address = self.section.address
                        self._streams = await asyncio.open_connection(address.host, address.port)
                reader, writer = self._streams
                writer.write(json.dumps({"verb": verb, **more}).encode() + b"\n")
                async with asyncio.timeout(self.section.answer_s):
                    return json.loads(await reader.readline())
            except (OSError, TimeoutError, ValueError) as error:
                self.close()
                raise Disconnected(f"{self.section.address} does not answer {verb}: {error or 'too late'}") from error

    async def identify(self) -> DeviceIdentity:
        return DeviceIdentity(**await self.ask("identify"))

    async def connect(self) -> Found:
        identity = await self.identify()
        state = await self.ask("read")
        bounds = tuple(Bound(name, value) for name, value in state.get("limits", {}).items())
        return Found(identity, (StatusWord("status", state.get("word", "0x00")),), bounds)

    def close(self) -> None:
        streams, self._streams = self._streams, None
        if streams is not None and self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(streams[1].close)


class LineTable(_Line):
    async def move_to(self, angles: TableAngles) -> None:
        await self.ask("move", angles=[angles.outer_deg, angles.middle_deg, angles.inner_deg])

    async def command_turn(self, turn: Turn) -> None:
        await self.ask("turn", moving=True)

    async def command_rate(self, rate: ConstantRate) -> None:
        await self.ask("rate", moving=True)

    async def command_sinusoid(self, sinusoid: Sinusoid) -> None:
        raise OutOfRange("no sinusoids")

    def trace(self) -> EncoderTrace:
        return NO_TRACE

    async def settle(self) -> None:
        await self.ask("settle", moving=False)

    async def read(self) -> TableReading:
        s = await self.ask("read")
        now_s = self.context.clock.now_s()
        return TableReading(now_s, TableAngles(*s["angles"]), s["moving"], homed=s.get("homed", True))

    async def make_safe(self) -> None:
        if (await self.ask("read"))["moving"]:
            await self.ask("stop", **({} if (await self.ask("read")).get("runaway") else {"moving": False}))


class LineSupply(_Line):
    @property
    def limits(self) -> SupplyLimits:
        return SupplyLimits(**self.section.limits.model_dump())

    async def set_output(self, voltage_v: float, current_a: float) -> None:
        await self.ask("set", volts=voltage_v, amperes=current_a)

    async def switch_on(self) -> None:
        await self.ask("on", on=True)

    async def switch_off(self) -> None:
        await self.ask("off", **({} if (await self.ask("read")).get("stuck") else {"on": False}))

    async def read(self) -> SupplyReading:
        s = await self.ask("read")
        volts = s["volts"] if s["on"] else 0.0
        now_s = self.context.clock.now_s()
        return SupplyReading(now_s, s["on"], volts, volts / 32.0, False, False, s["volts"], s["amperes"])

    async def make_safe(self) -> None:
        await self.switch_off()


class LineChamber(_Line):
    @property
    def limits(self) -> ChamberLimits:
        return ChamberLimits(**self.section.limits.model_dump())

    async def command(self, temperature_c: float, ramp_c_min: float) -> None:
        await self.ask("go", target=temperature_c)

    async def read(self) -> ChamberReading:
        s = await self.ask("read")
        return ChamberReading(self.context.clock.now_s(), s["air"], None, s["target"], False, False)

    async def make_safe(self) -> None:
        if (await self.ask("read"))["target"] is None:
            return
        policy = self.section.on_safe
        if policy != "hold":
            await self.ask("go", target=self.limits.ambient_c if policy == "ambient" else None)


def table(**more: Any) -> LineDevice:
    identity = {"maker": "Line", "model": "T3", "serial": "T-7", "firmware": "1.2"}
    return LineDevice({"identity": identity, "angles": [0.0, 0.0, 0.0], "moving": False, **more})


def supply(**more: Any) -> LineDevice:
    identity = {"maker": "Line", "model": "P1", "serial": "P-3", "firmware": "4.0"}
    return LineDevice({"identity": identity, "on": False, "volts": 28.0, "amperes": 3.0, **more})


def chamber(**more: Any) -> LineDevice:
    identity = {"maker": "Line", "model": "C9", "serial": "C-1", "firmware": "2.1"}
    return LineDevice({"identity": identity, "air": 22.0, "target": None, **more})


SHIPPED: dict[tuple[Kind, str], str] = {
    ("turntable", "line"): f"{__name__}:TABLE",
    ("supply", "line"): f"{__name__}:SUPPLY",
    ("chamber", "line"): f"{__name__}:CHAMBER",
}
TABLE = DeviceDriver("turntable", "line", WireTurntable, LineTable)
SUPPLY = DeviceDriver("supply", "line", WireSupply, LineSupply)
CHAMBER = DeviceDriver("chamber", "line", WireChamber, LineChamber)


def bench_text(table: LineDevice, supply: LineDevice, chamber: LineDevice, more: str = "") -> str:
    """A bench file of these devices, with a simulated unit."""
    axis = "minimum_deg = -400, maximum_deg = 400, rate_deg_s = 60, acceleration_deg_s2 = 100"
    short = "answer_s = 0.4\nconnect_s = 0.5\nsafe_s = 2.0"
    return f"""
[bench]
id = "east"
[site]
latitude_deg = 50.45
gravity_m_s2 = 9.810553
[turntable]
driver = "line"
address = "tcp://127.0.0.1:{table.port}"
{short}
outer = {{ {axis}, continuous = true }}
middle = {{ {axis} }}
inner = {{ {axis} }}
accuracy = {{ orthogonality_sd_arcsec = 3, pointing_sd_arcsec = 2, level_sd_arcsec = 1, encoder_sd_arcsec = 0.5 }}
[supply]
driver = "line"
address = "tcp://127.0.0.1:{supply.port}"
{short}
limits = {{ minimum_v = 0, maximum_v = 32, maximum_a = 4, nominal_v = 28, nominal_a = 3 }}
[chamber]
driver = "line"
address = "tcp://127.0.0.1:{chamber.port}"
{short}
limits = {{ minimum_c = -55, maximum_c = 85, ramp_c_min = 3, ambient_c = 22 }}
{more}
"""
