"""Heat of a mixed bench: a simulated unit stands in the air of a real chamber.

The chamber's air is read before time passes, at most once in `AIR_S` of bench time, and the simulated unit's heat goes
on in air of that temperature; so it lags behind by `AIR_S` at the most, which at 3 K/min is 0.05 K. A chamber that
cannot be read ends the job: the unit's temperature would not be known.
"""

from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench_service.drivers.wired.mixed import MixedClock
from procedures.bench import Chamber, Clock
from procedures.bench.imu import Stream
from procedures.core.recording import Station

AIR_S = 1.0
"""Shortest bench time between two readings of the air [s]."""


class RealAir:
    """Gives the air temperature of a real chamber to the heat of a simulated unit."""

    def __init__(self, chamber: Chamber, clock: Clock, follow: Callable[[float], object]) -> None:
        """Set up; `follow`: has the simulated unit stand in air of a temperature [°C]."""
        self._chamber, self._clock, self._follow = chamber, clock, follow
        self._read_s = -inf

    async def look(self) -> None:
        """Read the chamber's air, where the last reading is old enough, and pass it to the unit. Raises
        `Disconnected`.
        """
        now_s = self._clock.now_s()
        if now_s - self._read_s >= AIR_S:
            self._read_s = now_s
            self._follow((await self._chamber.read()).air_c)


class AiredClock:
    """Implements `procedures.bench.clock.Clock`; the air is read while it sleeps."""

    def __init__(self, clock: MixedClock, air: RealAir) -> None:
        self._clock, self._air = clock, air

    def now_s(self) -> float:
        return self._clock.now_s()

    async def sleep(self, seconds: float) -> None:
        until_s = self._clock.now_s() + seconds
        await self._air.look()
        while (left_s := until_s - self._clock.now_s()) > AIR_S:
            await self._clock.sleep(min(AIR_S, left_s))
            await self._air.look()
        await self._clock.sleep(max(0.0, until_s - self._clock.now_s()))


class AiredUnit:
    """A simulated unit whose recordings continue in real air; every other verb is its own."""

    def __init__(self, unit: Any, air: RealAir) -> None:
        self._unit, self._air = unit, air

    def __getattr__(self, name: str) -> Any:
        return getattr(self._unit, name)

    def record(self, duration_s: float, station: Station | None = None) -> Stream:
        stream: Stream = self._unit.record(duration_s, station)
        return replace(stream, blocks=self._blocks(stream.blocks))

    async def _blocks(self, blocks: AsyncIterator[NDArray[np.int32]]) -> AsyncIterator[NDArray[np.int32]]:
        try:
            while True:
                await self._air.look()
                try:
                    block = await anext(blocks)
                except StopAsyncIteration:
                    return
                yield block
        finally:
            if (close := getattr(blocks, "aclose", None)) is not None:
                await close()
