"""Making the devices of a bench safe at the same time, each with its own deadline, so that none waits for another."""

import asyncio
from collections.abc import Mapping
from typing import Protocol

from procedures.bench.errors import Disconnected

LEAST_S = 5.0
"""Deadline of a device that has none of its own, as a simulated one beside real ones [s, real time]."""


class SafeDevice(Protocol):
    """A device that can be made safe. Interface of the drivers of a wired bench."""

    async def make_safe(self) -> None: ...


async def make_safe_together(devices: Mapping[str, SafeDevice], deadlines_s: Mapping[str, float]) -> None:
    """Make every device safe at the same time, and wait until each is safe or its deadline [s] is over. Raises an
    `ExceptionGroup` of the failures, after all have ended or are late.
    """

    async def one(name: str, device: SafeDevice) -> None:
        limit_s = deadlines_s.get(name, LEAST_S)
        try:
            async with asyncio.timeout(limit_s):
                await device.make_safe()
        except TimeoutError:
            raise Disconnected(f"the {name.replace('_', ' ')} was not safe within {limit_s:g} s") from None

    outcomes = await asyncio.gather(*(one(n, d) for n, d in devices.items()), return_exceptions=True)
    failures = [outcome for outcome in outcomes if isinstance(outcome, Exception)]
    if failures:
        raise ExceptionGroup("the bench could not be made safe", failures)
