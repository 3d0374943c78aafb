"""Temperature sensors of the unit: lag, offset, noise, quantization; and their faults.

``y' = (T − y)/lag`` between whole seconds, T a straight line; ``code = round((y + error(y) + noise)/step)`` with
``error(y) = offset + slope·(y − 20 °C)``.
"""

from collections.abc import Sequence
from math import exp
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.chamber.network import CASE, CONVERTER, GYRO
from simulators.chamber.plant import BLOCK_STEPS, STEP_S
from simulators.truth import Array, KeyedBlocks
from simulators.truth.thermal import REFERENCE_C, THERMOMETERS, ThermometerTruth

DISCONNECTED_CODE = -32768
"""Code of a sensor that is disconnected: the smallest number of 16 bits."""
COLUMNS = (CASE, CONVERTER, *range(GYRO.start, GYRO.stop))
"""Nodes on which the sensors sit, in the order of `THERMOMETERS`."""

Codes = NDArray[np.int32]


class Thermometers:
    """Five temperature sensors read once a second."""

    def __init__(self, truths: Sequence[ThermometerTruth], seed: int, start_c: float) -> None:
        """Start with all sensors in equilibrium at `start_c`."""
        self.truths = tuple(truths)
        self._draws = [KeyedBlocks(seed, "thermometer", name) for name in THERMOMETERS]
        self._block, self._normal = -1, np.empty((0, len(self.truths)))
        self._lagged = np.full(len(self.truths), start_c)
        self._before = np.full(len(self.truths), start_c)
        errors = [t.offset_c + t.slope * (start_c - REFERENCE_C) for t in self.truths]
        self._last = [round((start_c + e) / t.step_c) for e, t in zip(errors, self.truths, strict=True)]
        self.sent = np.array(self._last, dtype=np.int32)
        """Codes of the last second, (5,)."""
        self.sent[[t.disconnected_from_s <= 0.0 for t in self.truths]] = DISCONNECTED_CODE
        self._offset, self._slope, self._noise_sd, self._step, lag = (
            np.array([getattr(t, name) for t in self.truths])
            for name in ("offset_c", "slope", "noise_c", "step_c", "lag_s")
        )
        self._decay = np.array([exp(-STEP_S / t.lag_s) if t.lag_s else 0.0 for t in self.truths])
        share = lag / STEP_S * (1.0 - self._decay)
        self._now, self._then = 1.0 - share, share - self._decay

    def read(self, first_step: int, temperatures_c: Array) -> Codes:
        """Codes (n, 5) of the seconds that end with the node temperatures (n, 8), the first being `first_step`."""
        count = len(temperatures_c)
        if count == 0:
            return np.empty((0, len(self.truths)), dtype=np.int32)
        lagged = self._lag(temperatures_c[:, COLUMNS])
        values = (
            lagged
            + self._offset
            + self._slope * (lagged - REFERENCE_C)
            + self._noise_sd * self._noise(first_step, count)
        )
        codes = np.rint(values / self._step).astype(np.int32)
        moments = (first_step + np.arange(count) + 1) * STEP_S
        for i, truth in enumerate(self.truths):
            if moments[-1] >= truth.stuck_from_s:
                working = codes[moments < truth.stuck_from_s, i]
                self._last[i] = int(working[-1]) if len(working) else self._last[i]
                codes[moments >= truth.stuck_from_s, i] = self._last[i]
            else:
                self._last[i] = int(codes[-1, i])
            if moments[-1] >= truth.disconnected_from_s:
                codes[moments >= truth.disconnected_from_s, i] = DISCONNECTED_CODE
        self.sent = codes[-1].copy()
        return codes

    def _lag(self, temperature: Array) -> Array:
        """First-order lags (n, 5), exact for straight lines between seconds; carry their state on."""
        before = np.concatenate([self._before[None], temperature[:-1]])
        driven = self._now * temperature + self._then * before
        lagged = self._lagged
        for row in driven:
            row += self._decay * lagged
            lagged = row
        self._lagged, self._before = lagged.copy(), temperature[-1].copy()
        return driven

    def _noise(self, first: int, count: int) -> Array:
        """Draw standard normal numbers for `count` seconds, (count, 5)."""
        rows: list[Array] = []
        at = first
        while at < first + count:
            block, begin = divmod(at, BLOCK_STEPS)
            if block != self._block:
                self._normal = np.column_stack([d.at(block).standard_normal(BLOCK_STEPS) for d in self._draws])
                self._block = block
            rows.append(self._normal[begin : begin + first + count - at])
            at += len(rows[-1])
        return np.concatenate(rows)

    def checkpoint(self) -> dict[str, Any]:
        """State of the sensors to resume from, JSON-ready."""
        return {
            "lagged": self._lagged.tolist(),
            "before": self._before.tolist(),
            "last": list(self._last),
            "sent": self.sent.tolist(),
        }

    def resume(self, state: dict[str, Any]) -> None:
        """Go on from the state of a checkpoint."""
        self._lagged, self._before = np.array(state["lagged"]), np.array(state["before"])
        self._last = [int(code) for code in state["last"]]
        self.sent = np.array(state["sent"], dtype=np.int32)
