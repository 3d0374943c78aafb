"""Making the devices of a bench safe at the same time, each with its own deadline, so that none waits for another."""

import asyncio
from collections.abc import Mapping
from typing import Protocol

from procedures.bench.errors import Disconnected

LEAST_S = 5.0
"""Deadline of a device that has none of its own, as a simulated one beside real ones [s, real time]."""
UNWIND_S = 0.5
"""Time that a late device's driver may take to leave its work [s, real time]."""


class SafeDevice(Protocol):
    """A device that can be made safe. Interface of the drivers of a wired bench."""

    async def make_safe(self) -> None: ...


async def make_safe_together(devices: Mapping[str, SafeDevice], deadlines_s: Mapping[str, float]) -> None:
    """Make every device safe at the same time, and wait until each is safe or its deadline [s] is over. Raises an
    `ExceptionGroup` of the failures, after all have ended or are late.

    A late one is cancelled; a driver that does not leave even then is left alone after `UNWIND_S`, so that it holds up
    neither the others nor the way to safety over a new link.
    """

    async def one(name: str, device: SafeDevice) -> None:
        limit_s, named = deadlines_s.get(name, LEAST_S), name.replace("_", " ")
        making = asyncio.ensure_future(device.make_safe())
        try:
            await asyncio.wait((making,), timeout=limit_s)
            late = not making.done()
        finally:
            making.cancel()
        if late:
            await asyncio.wait((making,), timeout=UNWIND_S)
            if not making.done() or making.cancelled():
                raise Disconnected(f"the {named} was not safe within {limit_s:g} s")
        if making.cancelled():
            raise Disconnected(f"the {named}'s driver gave up before it was safe")
        await making

    outcomes = await asyncio.gather(*(one(n, d) for n, d in devices.items()), return_exceptions=True)
    failures = [outcome for outcome in outcomes if isinstance(outcome, Exception)]
    if failures:
        raise ExceptionGroup("the bench could not be made safe", failures)
