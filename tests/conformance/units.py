"""Implementations of the unit's data link, each with what a test must know and break."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from procedures.bench import Clock, Imu
from simulators.imu.tape import Tape
from simulators.served.at_once import at_once
from simulators.served.unit_frames import CountFrames
from simulators.world import WorldConfig, build
from tests.conformance.served import FACTOR, Served, opened, served

IMPLEMENTATIONS = ("simulated", "framed", "datagrams", "ixcom")


@dataclass
class UnitRig:
    """A unit's link, its clock, and what stands behind it."""

    port: Imu
    clock: Clock
    behind: Any
    switched: dict[str, bool]

    def power(self, on: bool) -> None:
        """Switch the unit, and let the driver know what the supply says."""
        self.switched["on"] = on

        async def switch(bench: Any) -> None:
            await (bench.supply.switch_on() if on else bench.supply.switch_off())

        if isinstance(self.behind, Served):
            self.behind.do(lambda served: at_once(switch(served.bench)))
        else:
            at_once(switch(self.behind))

    def listen(self) -> Tape:
        """A tape of all counts that the world makes from now on."""
        tape = Tape(6)
        if isinstance(self.behind, Served):
            self.behind.do(lambda served: served.bench.imu.listen(tape))
        else:
            self.behind.imu.listen(tape)
        return tape


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


@contextmanager
def unit(name: str, folder: Path, factor: float = FACTOR, **more: Any) -> Iterator[UnitRig]:
    """Open one implementation, the unit off."""
    switched = {"on": False}
    if name == "simulated":
        bench = build(WorldConfig())
        yield UnitRig(bench.imu, bench.clock, bench, switched)
        return
    section: dict[str, Any] = {"powered": lambda: switched["on"], **more.pop("section", {})}
    datagrams = _free_port() if name == "datagrams" else 0
    language = "ixcom" if name == "ixcom" else "framed"
    with served({"unit_link": language}, factor=factor, datagrams=datagrams, **more) as behind:
        frames = behind.bench.frames
        if isinstance(frames, CountFrames):
            (folder / "frame.toml").write_text(frames.description())
            section["frame"] = "frame.toml"
        if datagrams:
            section["address"] = f"udp://127.0.0.1:{datagrams}"
        device = opened("unit_link", language, behind.numbers["unit_link"], folder, factor, **section)
        try:
            yield UnitRig(device, device.clock, behind, switched)
        finally:
            device.close()
