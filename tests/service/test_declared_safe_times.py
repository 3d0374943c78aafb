"""The way to safety of real devices: each is given the time that its bench file declares, and none waits for another.

Times are those of the product, divided by twenty, but for the declared ones: a busy machine is late by half a second.
"""

import asyncio
from collections.abc import Awaitable, Callable, Generator
from dataclasses import replace
from threading import Event
from types import SimpleNamespace
from typing import Any

import pytest

from bench_service.bench import driven, together
from bench_service.bench.driven import DrivenBench
from bench_service.bench.make_safe import over_the_jobs_link
from bench_service.bench.watchdog import TimeLimits
from bench_service.drivers.wall_bench_clock import WallBenchClock
from bench_service.wall_clock import monotonic_s
from procedures.bench import Bench
from simulators.world import WorldConfig, build

LIMITS = TimeLimits(verb_s=0.25, block_s=0.1, motion_s=6.0, simulated_s=0.25, margin_s=0.1)
DECLARED_S = {"turntable": 8.0, "chamber": 6.0, "supply": 1.2}
SLOW_S = 0.7
"""Far above the 0.25 s of a verb and what the other devices take, and below every declared time."""
DEVICES = tuple(DECLARED_S)
Work = Callable[[], Awaitable[None]]
released = Event()


@pytest.fixture(autouse=True)
def scaled(monkeypatch: pytest.MonkeyPatch) -> Generator[None]:
    monkeypatch.setattr(driven, "TIME_LIMITS", LIMITS)
    monkeypatch.setattr(driven, "UNWIND_S", 0.2)
    monkeypatch.setattr(driven, "STOP_CHECK_S", 0.05)
    monkeypatch.setattr(together, "UNWIND_S", 0.1)
    released.clear()
    yield
    released.set()


class Devices:
    """Devices with declared times, and the times after which each was safe."""

    def __init__(self, **work: Work) -> None:
        self.safe_after_s: dict[str, float] = {}
        self._work = work
        self._begun_s = monotonic_s()

    def device(self, name: str) -> Any:
        async def make_safe() -> None:
            await self._work.get(name, takes(0.01))()
            self.safe_after_s[name] = monotonic_s() - self._begun_s

        return SimpleNamespace(make_safe=make_safe, trace=None)

    def driven(self) -> DrivenBench:
        """A bench of these devices, which are real; the unit is not asked."""
        world = build(WorldConfig())
        table, chamber, supply = map(self.device, DEVICES)
        description = replace(world.description, simulated=False)
        bench = Bench(description, WallBenchClock(), table, world.imu, supply, chamber, safe_s=DECLARED_S)
        self._begun_s = monotonic_s()
        return DrivenBench("a job", bench, lambda: False)


def takes(seconds: float) -> Work:
    """Work that takes a while, during which its driver says nothing."""
    return lambda: asyncio.sleep(seconds)


async def deaf() -> None:
    """As a driver that takes no cancel."""
    while not released.is_set():
        try:
            await asyncio.sleep(0.05)
        except asyncio.CancelledError:
            continue


async def holding() -> None:
    """As a vendor's library that does not return."""
    released.wait(30)


async def giving_up() -> None:
    raise asyncio.CancelledError


@pytest.mark.parametrize("device", DEVICES)
def test_a_device_that_takes_its_declared_time_is_not_cut_short(device: str) -> None:
    """Beyond the 0.25 s of a verb: the watchdog would end it there without the declared time."""
    devices = Devices(**{device: takes(SLOW_S)})
    bench = devices.driven()
    bench.make_safe()
    bench.close()
    assert set(devices.safe_after_s) == set(DEVICES)
    assert devices.safe_after_s.pop(device) >= SLOW_S
    assert max(devices.safe_after_s.values()) < SLOW_S, "the others are safe in their own time"


@pytest.mark.parametrize("how", [takes(30.0), deaf])
def test_a_late_device_is_named_and_the_table_brakes_to_its_end(how: Work) -> None:
    devices = Devices(supply=how, turntable=takes(SLOW_S))
    bench = devices.driven()
    failed, new_link_may_help = over_the_jobs_link(bench)
    bench.close()
    assert failed == ("the supply was not safe within 1.2 s",)
    assert new_link_may_help
    assert set(devices.safe_after_s) == {"turntable", "chamber"}
    assert (bench._lost is not None) == (how is deaf), "a thread that a driver does not leave is not waited for"


def test_a_driver_that_holds_the_thread_of_all_is_given_up_within_the_time_of_a_verb() -> None:
    """The table behind it is not served meanwhile: a new link is wanted now, not after the declared times."""
    devices = Devices(chamber=holding, turntable=takes(0.1))
    bench = devices.driven()
    begun_s = monotonic_s()
    failed, new_link_may_help = over_the_jobs_link(bench)
    took_s = monotonic_s() - begun_s
    assert took_s < 8.0, "0.25 s and two looks at 0.05 s, 0.2 s to unwind; the longest declared time is 8 s"
    assert failed == ("a driver has held the thread of all devices for 0.25 s",)
    assert new_link_may_help
    bench.close()


def test_a_driver_that_gives_up_has_made_nothing_safe() -> None:
    bench = Devices(supply=giving_up).driven()
    failed, new_link_may_help = over_the_jobs_link(bench)
    bench.close()
    assert failed == ("the supply's driver gave up before it was safe",)
    assert new_link_may_help
