"""Resolution of channels: whether their noise is less than the step that their samples are rounded to.

Counts or multiples of any step, whatever the number format. White noise of standard deviation s about a level, rounded
to steps of q, leaves the values v_k with frequencies that are differences of a normal distribution at the thresholds
halfway between them: ``s = (t_{k+1} − t_k)/(z_{k+1} − z_k)``, z the normal quantile of the share below a threshold.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from scipy.special import ndtri

from procedures.analysis.fitness.wording import amount, gain_of
from procedures.core.arrays import Array
from procedures.core.recording import INCREMENTS, Channel, RawArray

LOOKED_AT = 200_000
"""Number of first samples of a channel from which its resolution is judged."""
COUNTER, CONVERTER = 0.35, 0.2
"""Variance of samples [steps²] below which the reading error is no white noise: of a counter, of a converter.

A plain counter at a constant rate has at most ¼, and ⅙ for evenly spread readings; one of independent readings with a
triangular dither has ½. Rates converted with rounding have 1/12 in addition to their own noise: below 0.12 (0.34 of a
step) the rounded noise depends on where between two steps the mean lies.
"""
HIDDEN = sqrt(CONVERTER - 1.0 / 12.0)
"""Noise of a rounded rate [steps] below which its variance depends on the mean; estimated whatever the mean is."""
WINDOW, WINDOWS, FIRST = 2048, 48, 4
"""Samples that are judged together, so that a drift does not spread them; most windows; those that decide alone."""
MOST_VALUES = 8
"""Distinct values of a window: noise of a third of a step takes four, a drift adds some."""
SPREAD = 1.15
"""Factor from the estimated noise to its upper limit."""
SPANNED = 16.0
"""Steps over which a channel must move for its slow changes to be more than rounding."""


@dataclass(frozen=True)
class Coarse:
    """A channel whose noise is less than the step of its samples."""

    sentence: str
    step: float | None
    """Step [rate] of a rounded rate; None for a counter, whose sum keeps every change."""
    most_walk: float
    """Upper limit of the random walk of a rounded rate whose noise is white [rate·√s]."""
    hides_slow: bool
    """The channel moves over so few steps that slow changes are hidden, too."""


class Resolution:
    """Running collection of the first samples of channels, judged at the end."""

    def __init__(self, channels: Sequence[Channel], rate_hz: float) -> None:
        self._channels = tuple(channels)
        self._rate_hz = rate_hz
        self._parts: list[RawArray] = []
        self._seen = 0

    def add(self, block: RawArray, columns: Sequence[int]) -> None:
        """Take in the next samples (n, …); `columns` are the indices of the channels."""
        if self._seen < LOOKED_AT:
            part = block[: LOOKED_AT - self._seen][:, list(columns)]
            self._parts.append(part)
            self._seen += len(part)

    def finish(self) -> dict[str, Coarse]:
        """Return the channels whose noise is less than a step, by name."""
        if not self._parts:
            return {}
        samples = np.concatenate(self._parts)
        judged = (
            (c.name, self._counter(c, row) if c.quantity in INCREMENTS else self._rounded(c, row))
            for c, row in zip(self._channels, samples.T, strict=True)
        )
        return {name: coarse for name, coarse in judged if coarse is not None}

    def _counter(self, channel: Channel, row: RawArray) -> Coarse | None:
        step = 1.0 if np.issubdtype(row.dtype, np.integer) else step_of(np.asarray(row[:WINDOW], dtype=np.float64))
        if step is None:
            return None
        variance = float(np.var(row)) / step**2
        if not 0.0 < variance < COUNTER:
            return None
        told = (
            f"its samples vary by {np.sqrt(variance):.2g} counts: readings of a counter without dither "
            "err by a sawtooth, not by white noise; of the random walk only a limit is given"
        )
        return Coarse(told, None, 0.0, hides_slow=False)

    def _rounded(self, channel: Channel, row: RawArray) -> Coarse | None:
        found = rounded_noise(row)
        if found is None:
            return None
        step, noise = found
        gain = abs(gain_of(channel, self._rate_hz))
        told = (
            f"its samples stand {amount(channel, self._rate_hz, step)} apart, and their noise is {noise / step:.2g} of "
            "that or less: rounding hides most of it; only limits are given"
        )
        hides = float(np.ptp(row)) < SPANNED * step
        return Coarse(told, step * gain, SPREAD * noise * gain / sqrt(self._rate_hz), hides_slow=hides)


def step_of(values: Array) -> float | None:
    """Return the least distance of distinct values (n,), or None if they are many, or one."""
    levels = np.unique(values)
    return float(np.min(np.diff(levels))) if 1 < len(levels) <= MOST_VALUES else None


def rounded_noise(samples: RawArray) -> tuple[float, float] | None:
    """Return the step of rounded samples (n,) and their noise, which is less than `HIDDEN` of it; else None.

    The noise is the median of that of windows, an upper bound where a window shows only one or two values.
    """
    size = max(1, min(WINDOW, len(samples) // FIRST))
    starts = np.unique(np.linspace(0, len(samples) - size, WINDOWS).astype(np.int64))
    order = [*starts[:: max(1, len(starts) // FIRST)].tolist(), *starts.tolist()]
    found: list[tuple[float | None, float]] = []
    for k, start in enumerate(order):
        if k == FIRST and all(share > HIDDEN for _, share in found):
            return None
        found.append(_noise(np.asarray(samples[start : start + size], dtype=np.float64)))
    steps = [step for step, _ in found if step is not None]
    share = float(np.median([share for _, share in found]))
    if not steps or share > HIDDEN:
        return None
    step = float(np.median(steps))
    return step, share * step


def _noise(window: Array) -> tuple[float | None, float]:
    """The step of a window and the standard deviation of its noise in steps; infinite where the values are many."""
    levels, counts = np.unique(window, return_counts=True)
    if len(levels) > MOST_VALUES:
        return None, np.inf
    unseen = float(ndtri(1.0 - 1.0 / max(len(window), 2)))
    if len(levels) == 1:
        return None, 0.5 / unseen
    step = float(np.min(np.diff(levels)))
    z = ndtri(np.cumsum(counts)[:-1] / len(window))
    if len(levels) == 2:  # the next threshold lies beyond what a window shows
        return step, float(np.round(np.diff(levels)[0] / step)) / (unseen + abs(float(z[0])))
    middle = 0.5 * (levels[1:] + levels[:-1])
    best = int(np.argmin(np.maximum(np.abs(z[1:]), np.abs(z[:-1]))))
    return step, float((middle[best + 1] - middle[best]) / (z[best + 1] - z[best])) / step
