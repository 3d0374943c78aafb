"""Work on several devices at once, each in its own thread and event loop and with its own deadline."""

import asyncio
from collections.abc import Callable, Coroutine, Mapping
from threading import Lock, Thread
from typing import Any, TypeVar

from procedures.bench.errors import Disconnected

K = TypeVar("K", bound=str)
T = TypeVar("T")
GRACE_S = 0.5
"""Time beyond its deadline after which a driver that holds its thread is left alone [s]."""


def in_parallel(
    work: Mapping[K, Callable[[], Coroutine[Any, Any, T]]],
    deadlines_s: Mapping[K, float],
    done: Callable[[K, T | Exception], None] = lambda _device, _found: None,
) -> dict[K, T | Exception]:
    """Run one coroutine for each device; its outcome, or the exception that ended it.

    A device that is not done at its deadline is `Disconnected`, and holds up no other: `done` is called for each as it
    ends, one at a time. A driver that blocks its thread loses it.
    """
    found: dict[K, T | Exception] = {}
    mutex = Lock()

    def tell(device: K, outcome: T | Exception) -> None:
        with mutex:
            if device not in found:
                found[device] = outcome
                done(device, outcome)

    def run(device: K) -> None:
        late = Disconnected(f"the {named(device)} was not done within {deadlines_s[device]:g} s")

        async def within() -> T:
            try:
                async with asyncio.timeout(deadlines_s[device]):
                    return await work[device]()
            except TimeoutError:
                raise late from None

        try:
            tell(device, asyncio.run(within()))
        except Exception as failure:
            tell(device, failure)

    threads = {device: Thread(target=run, args=(device,), name=f"device {device}", daemon=True) for device in work}
    for thread in threads.values():
        thread.start()
    for device in sorted(threads, key=lambda d: deadlines_s[d]):
        threads[device].join(deadlines_s[device] + GRACE_S)
        tell(device, Disconnected(f"the {named(device)} holds its driver for more than {deadlines_s[device]:g} s"))
    return found


def named(device: str) -> str:
    """Return the name of a device for a person, such as "unit link"."""
    return device.replace("_", " ")
