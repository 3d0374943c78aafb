"""A whole bench that is served: one world, its devices on ports, its time at a stated factor, its faults by a plan."""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from simulators.clock import Wait
from simulators.imu.device import SimImu
from simulators.served.acutrol import AcutrolLanguage
from simulators.served.at_once import at_once
from simulators.served.chamber import TYPE, ChamberTalker, Controller
from simulators.served.faults import Fault, FaultPlan
from simulators.served.pace import MADE_UP_S, Pace, PacedClock
from simulators.served.person import PersonPort
from simulators.served.ports import LinePort, Lines
from simulators.served.scpi import ScpiLanguage
from simulators.served.table import FAULT, ControlledTable
from simulators.served.unit import DatagramPort, FramePort, IxcomPort, Stream
from simulators.served.unit_frames import CountFrames, IxcomFrames
from simulators.truth import temperature_channels, unit_channels
from simulators.world import SimulatedBench, WorldConfig, build

Language = Literal["acutrol", "simserv", "ascii2", "scpi", "ixcom", "framed", "person"]
LANGUAGES: dict[str, tuple[str, ...]] = {
    "turntable": ("acutrol",),
    "chamber": ("simserv", "ascii2"),
    "supply": ("scpi",),
    "unit_link": ("ixcom", "framed"),
    "operator": ("person",),
}
LOOK_S = 0.02
"""Real time between two looks at the plan of faults [s]."""


@dataclass(frozen=True)
class ServedDevice:
    """Place and language of one served device."""

    language: str
    host: str = "127.0.0.1"
    port: int = 0
    """Port; 0: any free one."""
    datagrams: bool = False
    """True for a unit that sends datagrams to the place instead of listening there."""
    options: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Settings of a table (numbers, prefix_bytes, ending) or of a chamber (type)."""


@dataclass(frozen=True)
class ServedConfig:
    """Configuration of a served bench."""

    world: WorldConfig
    devices: Mapping[str, ServedDevice]
    factor: float = 1.0
    """Bench seconds in a real second."""
    faults: Sequence[Fault] = ()
    made_up_s: float = MADE_UP_S
    """Longest pause of the process that is made up for [s, real time]."""
    valid_after_s: float = 0.5
    """Time from switching the unit on to its first valid data [s of the bench]."""

    def __post_init__(self) -> None:
        for name, device in self.devices.items():
            if device.language not in LANGUAGES.get(name, ()):
                spoken = ", ".join(LANGUAGES.get(name, ())) or "nothing"
                raise ValueError(f"{name}: {device.language!r} is not served; there is {spoken}")


class Port(Protocol):
    """Port of one device."""

    async def open(self, host: str, port: int) -> int: ...

    async def close(self) -> None: ...

    def cut(self) -> None: ...


class ServedBench:
    """World behind ports. `open` and `close` belong to one event loop."""

    def __init__(self, config: ServedConfig, now_s: Callable[[], float], wait: Wait) -> None:
        """Build the world; `now_s`: real time; `wait`: waits real seconds."""
        self.config, self._wait = config, wait
        self.clock = PacedClock(config.world.rate_hz)
        self.bench: SimulatedBench = build(config.world, clock=self.clock, table=ControlledTable)
        self.pace = Pace(self.clock, config.factor, now_s, wait, config.made_up_s)
        self.plan = FaultPlan(tuple(config.faults))
        self.ports: dict[str, Port] = {}
        self.frames: CountFrames | IxcomFrames | None = None
        self._tasks: list[asyncio.Task[None]] = []

    @property
    def table(self) -> ControlledTable:
        """Return the served table, on which a person at the machine can act too: interlocks, setting by hand."""
        table = self.bench.turntable
        assert isinstance(table, ControlledTable)
        return table

    async def open(self) -> dict[str, int]:
        """Open all ports and let time pass. Returns the port number of each device."""
        self._make_slow_things()
        numbers: dict[str, int] = {}
        for name, device in self.config.devices.items():
            self.ports[name] = self._port(name, device)
            numbers[name] = await self.ports[name].open(device.host, device.port)
        self._tasks = [asyncio.create_task(self.pace.run()), asyncio.create_task(self._break_in_time())]
        return numbers

    async def close(self) -> None:
        """Close all ports and stop time."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for port in self.ports.values():
            await port.close()

    def check(self) -> None:
        """Raise the error that ended the passing of time, if there was one."""
        for task in self._tasks:
            if task.done() and not task.cancelled():
                task.result()

    def break_now(self, fault: Fault) -> None:
        """Apply a fault to its device at once."""
        chamber = self.bench.chamber
        if fault.kind == "stuck_sensor" and fault.device == "turntable":
            self.table.stuck_deg = self.table.true_encoders_deg()
        elif fault.kind == "stuck_sensor" and chamber is not None:
            chamber.plant.fail("control_sensor_stuck")
        elif fault.kind == "trip" and fault.device == "supply":
            self.bench.supply.trip()
        elif fault.kind == "trip" and chamber is not None:
            chamber.plant.state.tripped = True
            chamber.plant.switch_off()
        elif fault.kind == "door" and chamber is not None:
            chamber.set_door(True)
        elif fault.kind == "interlock":
            for axis in range(3):
                self.table.open_interlock(axis, FAULT)

    def _make_slow_things(self) -> None:
        """Have the first launch of the process before a port is open: it takes seconds, and no supply is so slow."""
        other = build(self.config.world)
        at_once(other.supply.switch_on())
        other.clock.advance_world(1)

    async def _break_in_time(self) -> None:
        while True:
            for fault in self.plan.due(self.clock.now_s()):
                self.break_now(fault)
            await self._wait(LOOK_S)

    def _port(self, name: str, device: ServedDevice) -> Port:
        options = device.options
        if name == "unit_link":
            return self._unit_port(device)
        if name == "operator":
            return PersonPort(self.bench.operator)
        if name == "supply":
            return LinePort(name, Lines(b"\n", ScpiLanguage(self.bench.supply).answer), self.plan, self._wait)
        if name == "chamber":
            kind = str(options.get("type", TYPE))
            if self.bench.chamber is None:
                raise ValueError("chamber: the world has none; it needs thermal = True")
            return LinePort(name, ChamberTalker(Controller(self.bench.chamber), kind), self.plan, self._wait, masters=5)
        language = AcutrolLanguage(
            self.table,
            options.get("numbers", (1, 2, 3)),
            options.get("prefix_bytes", 8),
            options.get("ending", b"\r\n"),
        )
        return LinePort(name, Lines(b"\r\n", language.answer), self.plan, self._wait)

    def frames_of(self, name: str) -> CountFrames | IxcomFrames:
        """Frames that the unit sends on this bench. Raises `ValueError` where it sends none."""
        imu, unit = self.bench.imu, self.config.world.unit
        if not isinstance(imu, SimImu):
            raise ValueError(f"{name}: a converter alone is not served")
        channels = (*unit_channels(unit), *temperature_channels(unit))
        if self.config.devices[name].language == "ixcom":
            return IxcomFrames(channels, imu.rate_hz)
        return CountFrames(channels, imu.rate_hz, 11 if self.config.world.thermal else 6)

    def _unit_port(self, device: ServedDevice) -> Port:
        frames, imu = self.frames_of("unit_link"), self.bench.imu
        assert isinstance(imu, SimImu)
        stream = Stream(frames, imu.rate_hz, lambda: imu.since_launch_s, self.config.valid_after_s)
        stream.plan, self.frames = self.plan, frames
        imu.listen(stream)
        if isinstance(frames, IxcomFrames):
            return IxcomPort(stream, self.config.world.unit.serial, imu.rate_hz)
        if device.datagrams:
            return DatagramPort(stream, frames.length)
        return FramePort(stream)
