"""Channels that grow by one and the same step: a counter of samples or a clock in place of a sensor."""

import numpy as np

from procedures.analysis.fitness.pieces import Samples
from procedures.core.arrays import Array

EVEN = 0.1
"""Greatest departure of a step from the usual one, as part of it: no sensor at rest drifts by ten times its noise from
sample to sample, and stamps jitter."""
SHARE = 0.98
"""Least share of such steps: an 8-bit counter begins again once in 256."""
LOOK = 256
"""Differences of the first piece that part nearly all channels."""


class Counters:
    """The channels that grow by equal steps so far, with their steps."""

    def __init__(self) -> None:
        self._steps: dict[int, float] | None = None
        self._equal: dict[int, int] = {}
        self._seen = 0

    def add(self, d: Samples) -> None:
        """Take in differences between neighbouring samples, (channels, n)."""
        if not d.shape[1]:
            return
        if self._steps is None:
            usual: Array = np.median(d[:, :LOOK].astype(np.float64), axis=1)
            self._steps = {c: float(usual[c]) for c in np.flatnonzero(usual).tolist()}
            for c in list(self._steps):
                self._drop_unless_even(c, d[c, :LOOK])
            self._equal = dict.fromkeys(self._steps, 0)
        self._seen += d.shape[1]
        for c in list(self._steps):
            self._equal[c] += self._drop_unless_even(c, d[c])

    def found(self) -> dict[int, float]:
        """Return the step of each channel that grows by equal steps, in raw units by column."""
        steps = self._steps or {}
        return {c: step for c, step in steps.items() if self._equal[c] >= SHARE * self._seen}

    def _drop_unless_even(self, c: int, d: Samples) -> int:
        """The number of equal steps; a channel with too few of them is out of question."""
        assert self._steps is not None
        step = self._steps[c]
        equal = int(np.count_nonzero(np.abs(d - step) <= EVEN * abs(step)))
        if equal < SHARE * d.shape[-1] - 1:
            del self._steps[c]
        return equal
