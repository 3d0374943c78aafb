"""A simulated bench to which something is done once it is open, and hang time-outs of tenths of a second."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench_service.bench.watchdog import TimeLimits
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.simulated import SimulatedDriver
from procedures.bench import Bench, BenchNeeds
from procedures.bench.errors import BenchError

IMPATIENT = TimeLimits(0.4, 0.4, 0.8, 0.4)


class FailingDriver(SimulatedDriver):
    """A simulated bench, and something that is done to it once it is open."""

    def __init__(self, folder: Path, change: Callable[[Bench], None] = lambda _: None, **given: Any) -> None:
        super().__init__("sim", register=DeviceRegister(folder, "sim"), **given)
        self.change = change
        self.unreachable = False

    def open(self, unit: str, seed: int | None, checkpoint: Any, needs: BenchNeeds, job: str | None = None) -> Bench:
        bench = super().open(unit, seed, checkpoint, needs, job)
        self.change(bench)
        return bench

    def make_safe(self, by: str) -> Any:
        if self.unreachable:
            raise BenchError("nothing answers on the table's line")
        return super().make_safe(by)
