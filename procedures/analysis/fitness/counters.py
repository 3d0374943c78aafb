"""Channels that grow by one and the same step: a counter of samples or a clock in place of a sensor."""

import numpy as np

from procedures.analysis.fitness.pieces import Samples
from procedures.core.arrays import Array

EVEN = 0.1
"""Greatest departure of a step from the usual one, as a part of it: time stamps jitter by less, and no sensor at rest
drifts by ten times its noise from sample to sample."""
SHARE = 0.98
"""Least share of such steps: an 8-bit counter begins again once in 256."""
LOOK = 256
"""Number of first differences that are enough to rule out nearly all channels."""


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
            first = d[:, :LOOK]
            usual: Array = np.median(first.astype(np.float64), axis=1)
            moving = ((c, float(usual[c])) for c in np.flatnonzero(usual).tolist())
            self._steps = {c: step for c, step in moving if _number_of(step, first[c]) is not None}
            self._equal = dict.fromkeys(self._steps, 0)
        self._seen += d.shape[1]
        for c, step in list(self._steps.items()):
            equal = _number_of(step, d[c])
            if equal is None:
                del self._steps[c]
            else:
                self._equal[c] += equal

    def found(self) -> dict[int, float]:
        """Return the step of each channel that grows by equal steps, in raw units by column."""
        steps = self._steps or {}
        return {c: step for c, step in steps.items() if self._equal[c] >= SHARE * self._seen}


def _number_of(step: float, d: Samples) -> int | None:
    """Number of differences (n,) that equal the step; None: too few of them."""
    equal = int(np.count_nonzero(np.abs(d - step) <= EVEN * abs(step)))
    return equal if equal >= SHARE * len(d) - 1 else None
