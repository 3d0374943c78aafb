"""Live values of a unit in manual mode: short recordings that are not stored, as means in nominal units.

They are read past the bench's observers: neither journal nor watchdog notes a recording of a tenth of a second.
"""

from collections.abc import AsyncGenerator
from contextlib import aclosing
from typing import Any, cast

import numpy as np

from bench_service.bench.live.values import LiveSensor
from bench_service.wall_clock import monotonic_s
from procedures.bench import Bench
from procedures.bench.errors import BenchError, OutOfRange
from procedures.bench.imu import Stream
from procedures.core.recording import NominalScale, Station

AGAIN_S = 2.0
"""Pause after a reading that failed [s]: a unit that was just switched on sends nothing yet."""


class UnitReadings:
    """Means of the unit's channels in manual mode, read while bench time passes: `values`, the time of reading, and the
    problem where they cannot be read.
    """

    def __init__(self, bench: Bench) -> None:
        self._imu = getattr(bench, "inner", bench).imu
        self._clock = bench.clock
        self._on = False
        self._warm = True
        self._again_s = 0.0
        self.values: tuple[LiveSensor, ...] = ()
        self.at_s: float | None = None
        """Bench time of the newest values [s]; None: there are none."""
        self.problem = ""
        """The reason why the last reading failed; empty: it did not."""

    def powered(self, on: bool) -> None:
        """Note whether the unit has power now; without power the values are dropped."""
        if not on:
            self.values, self.at_s, self.problem = (), None, ""
        self._on = on

    async def read(self, seconds: float) -> bool:
        """Read the unit's channels for some seconds of bench time; return False where it was not read, and no time
        passed.
        """
        if not self._on or monotonic_s() < self._again_s:
            return False
        try:
            await self._read(max(seconds, 1.0 / self._imu.rate_hz))
        except OutOfRange:  # a bench without chamber, or frames without temperatures
            if not self._warm:
                raise
            self._warm = False
            return False
        except BenchError as failure:
            self.problem, self._again_s = str(failure), monotonic_s() + AGAIN_S
            return False
        return True

    async def _read(self, seconds: float) -> None:
        stream: Stream = self._imu.record(seconds, Station(0, "manual", temperatures=self._warm))
        total, count = np.zeros(len(stream.channels)), 0
        async with aclosing(cast("AsyncGenerator[Any]", stream.blocks)) as blocks:
            async for block in blocks:
                total += block.sum(axis=0)
                count += len(block)
        if not self._on or count == 0:  # switched off meanwhile
            return
        means = NominalScale.of(stream.channels, stream.rate_hz).rates(total / count)
        self.values = tuple(
            LiveSensor(c.name, c.rate_unit, float(v)) for c, v in zip(stream.channels, means, strict=True)
        )
        self.at_s, self.problem = self._clock.now_s(), ""
