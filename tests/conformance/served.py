"""A served bench in a thread of its own, and drivers that talk to it: the two ends of a wire in one test process."""

import asyncio
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from bench_service.drivers.interface.driver import DriverContext, Kind
from bench_service.drivers.interface.registry import driver
from bench_service.drivers.wall_bench_clock import WallBenchClock
from procedures.core.unit import Unit
from simulators.served.bench import ServedBench, ServedConfig, ServedDevice
from simulators.served.faults import Fault
from simulators.served.pace import LONGEST_S
from simulators.truth import declared_unit, default_unit
from simulators.world import WorldConfig

T = TypeVar("T")
FACTOR = 20.0
CHAMBER_LIMITS = {"minimum_c": -60.0, "maximum_c": 85.0, "ramp_c_min": 3.0, "ambient_c": 22.0}
SUPPLY_LIMITS = {"maximum_v": 36.0, "maximum_a": 5.0, "nominal_v": 28.0, "nominal_a": 3.0}


def axis(number: int, span: float, **more: Any) -> dict[str, Any]:
    """An axis of a bench file."""
    limits = {"minimum_deg": -span, "maximum_deg": span, "rate_deg_s": 60.0, "acceleration_deg_s2": 100.0}
    return {"number": number, **limits, **more}


class Served:
    """A served bench that runs in a thread; `do` calls into its loop."""

    def __init__(self, config: ServedConfig) -> None:
        self.config = config
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="served bench", daemon=True)
        self._begun = threading.Event()
        self.numbers: dict[str, int] = {}
        self.bench: ServedBench

    def __enter__(self) -> "Served":
        self._thread.start()
        assert self._begun.wait(30.0)
        return self

    def __exit__(self, *_: object) -> None:
        asyncio.run_coroutine_threadsafe(self.bench.close(), self._loop).result(10.0)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10.0)
        self._loop.close()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)

        async def begin() -> None:
            self.bench = ServedBench(self.config, time.monotonic, asyncio.sleep)
            self.numbers = await self.bench.open()
            self._begun.set()

        self._loop.create_task(begin())
        self._loop.run_forever()
        pending = asyncio.all_tasks(self._loop)
        for task in pending:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*pending, return_exceptions=True))

    def do(self, call: Callable[[ServedBench], T]) -> T:
        """Call with the bench in its own loop."""

        async def within() -> T:
            return call(self.bench)

        return asyncio.run_coroutine_threadsafe(within(), self._loop).result(10.0)

    def requests(self, device: str) -> list[str]:
        """Requests that have come to a device, as text."""
        return self.do(lambda bench: [r.decode("latin-1") for r in bench.ports[device].requests])  # type: ignore[attr-defined]

    def plan(self, *faults: Fault) -> None:
        """Replace the plan of faults, and count answers from here on."""

        def put(bench: ServedBench) -> None:
            bench.plan.faults = tuple(faults)
            bench.plan.sent.clear()

        self.do(put)


@contextmanager
def served(languages: dict[str, str], thermal: bool = False, factor: float = FACTOR, **more: Any) -> Iterator[Served]:
    """A served bench with devices by language; `more` goes into its configuration.

    A pause of the machine makes the world late by default: made up for, it would be a jump at this factor.
    """
    more.setdefault("made_up_s", LONGEST_S)
    datagrams = more.pop("datagrams", 0)
    devices = {name: ServedDevice(language) for name, language in languages.items()}
    if datagrams:
        devices["unit_link"] = replace(devices["unit_link"], datagrams=True, port=datagrams)
    world = more.pop("world", WorldConfig())
    with Served(ServedConfig(replace(world, thermal=thermal), devices, factor, **more)) as bench:
        yield bench


def opened(
    kind: Kind, name: str, port: int, folder: Path, factor: float = FACTOR, unit: Unit | None = None, **section: Any
) -> Any:
    """A device of a driver, at a port of this machine."""
    clock = WallBenchClock(factor=factor)
    made = driver(kind, name)
    address = section.pop("address", f"tcp://127.0.0.1:{port}")
    powered = section.pop("powered", lambda: True)
    parsed = made.section.model_validate({"driver": name, "address": address, "answer_s": 0.5, **section})
    context = DriverContext("wire", clock, folder, unit or declared_unit(default_unit()), powered, time_factor=factor)
    device = made.open(parsed, context)
    device.clock = clock
    return device


async def cancelled_at(verb: Any, suspension: int) -> BaseException | None:
    """Run a verb and cancel it at its n-th suspension, from 0; what it raised, None: it was over before."""
    seen = 0

    class Counted:
        def __await__(self) -> Iterator[Any]:
            nonlocal seen
            inner = verb.__await__()
            answer: Any = None
            while True:
                try:
                    waited = inner.send(answer)
                except StopIteration:
                    return
                if seen == suspension:
                    asyncio.get_running_loop().call_soon(task.cancel)
                seen += 1
                try:
                    answer = yield waited
                except BaseException as thrown:
                    try:
                        waited = inner.throw(thrown)
                    except StopIteration:
                        return
                    answer = yield waited

    async def run() -> None:
        await Counted()

    task = asyncio.create_task(run())
    await asyncio.wait([task])
    return (
        None
        if not task.cancelled() and task.exception() is None
        else (asyncio.CancelledError() if task.cancelled() else task.exception())
    )
