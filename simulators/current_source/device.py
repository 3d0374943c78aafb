"""Precision current source: implements `procedures.bench.current_source.CurrentSource`."""

from collections.abc import Callable
from math import isfinite
from typing import Any

import numpy as np

from procedures.bench.current_source import CurrentSourceLimits, CurrentSourceReading
from procedures.bench.device import DeviceIdentity
from procedures.bench.errors import OutOfRange
from simulators.truth import Array, CurrentSourceTruth, KeyedBlocks

BLOCK_TICKS = 1000
"""Number of ticks for which random numbers are drawn at a time."""


class SimCurrentSource:
    """Gives ``I·(1 + gain error) + zero error + noise``, the noise independent at each tick."""

    def __init__(
        self, truth: CurrentSourceTruth, limits: CurrentSourceLimits, seed: int, now_s: Callable[[], float]
    ) -> None:
        self.truth = truth
        self._limits = limits
        self._draws = KeyedBlocks(seed, "current source")
        self._now_s = now_s
        self._set_ma = 0.0

    @property
    def limits(self) -> CurrentSourceLimits:
        return self._limits

    async def identify(self) -> DeviceIdentity:
        """Identity of the simulated source."""
        return DeviceIdentity("simulated", "current source")

    async def read(self) -> CurrentSourceReading:
        """Return the present setting. Implements `CurrentSource.read`."""
        return CurrentSourceReading(self._now_s(), self._set_ma)

    async def set_current(self, current_ma: float) -> None:
        """Set the current from now on. Raises `OutOfRange`. Implements `CurrentSource.set_current`."""
        most = self._limits.maximum_ma
        if not (isfinite(current_ma) and abs(current_ma) <= most):
            raise OutOfRange(f"current_ma = {current_ma!r} is outside {-most:g} … {most:g}")
        self._set_ma = current_ma

    async def make_safe(self) -> None:
        """Set the current to zero."""
        self._set_ma = 0.0

    def currents_ma(self, first_tick: int, ticks: int) -> Array:
        """True currents during ticks of bench time, (ticks,) [mA]; the same whatever the pieces."""
        given = self._set_ma * (1.0 + 1e-6 * self.truth.gain_error_ppm) + self.truth.zero_error_ma
        blocks = range(first_tick // BLOCK_TICKS, (first_tick + ticks - 1) // BLOCK_TICKS + 1)
        noise = np.concatenate([self._draws.at(block).standard_normal(BLOCK_TICKS) for block in blocks])
        skip = first_tick % BLOCK_TICKS
        return given + self.truth.noise_ma * noise[skip : skip + ticks]

    def checkpoint(self) -> dict[str, Any]:
        """State of the device, from which it can resume."""
        return {"set_ma": self._set_ma}

    def resume(self, state: dict[str, Any]) -> None:
        """Go on from the state of a checkpoint."""
        self._set_ma = float(state["set_ma"])
