"""Pattern of the stamps of a recording: at the sample period, coarse, with rows lost, or as they arrived, in batches.

Model: the stamp of sample k is ``t_k = t_0 + k·P + e_k``. A coarse clock has ``|e_k|`` within its resolution, a late
arrival ``e_k ≥ 0`` that returns to nought, and a lost row raises k for good. A median of the steps knows neither.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from procedures.core.arrays import Array

CHUNK = 64
"""Number of rows over which a clock's own error is estimated."""
LONG_CHUNK = 1024
"""Number of rows over which a mean step is taken where rows come in batches."""
STAMPS = 8
"""Number of different stamps, on the average, in the rows over which a mean step is taken."""
FEW = 16
"""Number of steps below which no order shows: they are taken as of one length, and deviations as losses."""
COARSE = 0.9
"""Part of the resolution by which a stamp may be off its place on a coarse clock. Rounding is half of it."""
ON_LATTICE = 0.9
"""Share of the steps that are whole multiples of one where rows are lost from a uniform clock."""
SINGLE = 0.4
"""Share of the steps that are that base itself."""
DENSE = 0.6
"""The smallest ratio of the shortest step to the mean one that speaks for lost rows, where the order is regular."""
LONG_AND_SHORT = 0.004
"""Largest difference of the periods of long and short chunks where no row is lost in most of them, relative."""
MOST = 0.75
"""Quantile of the chunks' bands that is taken as the usual one."""
SHARED = 1.5
"""Resolution in periods beyond which rows share stamps, which counts as batches where they are regular."""
CLEAN = 0.002
"""Share of shorter steps that speaks against lost rows where the clock resolves only a step or two of its own."""
MANY = 16
"""Number of rows in a batch from which on one row more or less is as regular."""
REGULAR = 0.9
"""Share of the long steps with the usual distance and size that make the order regular."""


@dataclass(frozen=True)
class Pattern:
    """Pattern in which the stamps of a recording come: its kind, the period, the band of their errors, the size of
    batches.
    """

    kind: Literal["steady", "coarse", "batches", "jitter"]
    """The kind of pattern. steady: at the period; coarse: up to the resolution; batches, jitter: as they arrived."""
    period_s: float
    band_s: float
    """Spread of the stamps about their places, largest less smallest, over rows without a loss."""
    batch: int = 1
    """Number of rows that come together."""
    span: int = 1
    """Number of rows within which one is on time."""
    usual_band_s: float = 0.0
    """Band like `band_s`, but over most rows, where stamps come as they arrived."""


def find_pattern(
    stretches: Sequence[Array], resolution_s: float, tolerance: float, declared_s: float | None
) -> Pattern:
    """The pattern of stamps [s], from stretches of consecutive rows, each (n,) with n ≥ 2 and not falling.

    `resolution_s` is the clock's, `tolerance` of a step relative to the period is ordinary jitter, and `declared_s` the
    period that is expected, which decides where both readings are possible.
    """
    steps = np.concatenate([np.diff(t) for t in stretches])
    mean_s = _mean_step(stretches)
    base_s = _shortest_usual(steps)
    steady = Pattern("steady", _refined(stretches, base_s, tolerance), 2.0 * tolerance * base_s)
    if len(steps) < FEW or _expected(base_s, mean_s, declared_s):
        return steady
    by_mean = _expected(mean_s, base_s, declared_s)
    batch = _batch(steps, mean_s)
    near = abs(base_s / mean_s - 1.0) <= tolerance and _share_near(steps, base_s, tolerance) >= ON_LATTICE
    if near and resolution_s <= tolerance * base_s:
        return steady
    coarse_s = _coarse_period(stretches, resolution_s, mean_s)
    if coarse_s is not None and not (batch > 1 and resolution_s > SHARED * coarse_s):
        band_s = 2.0 * (tolerance * coarse_s + resolution_s)
        return Pattern("coarse", coarse_s, band_s, span=int(np.ceil(resolution_s / coarse_s)))
    regular = batch > 1 and base_s < DENSE * mean_s
    lattice = _is_lattice(steps, base_s, tolerance, resolution_s) and not by_mean and not regular
    if near or lattice:
        return steady
    mean_s = _batch_period(stretches, mean_s) if batch > 1 else _jitter_period(stretches, mean_s)
    chunks = _chunks(stretches, max(CHUNK, 4 * batch))
    bands = [float(np.ptp(t - mean_s * np.arange(len(t)))) for t in chunks]
    usual_s = float(np.quantile(bands, MOST))  # of those without a loss
    return Pattern("batches" if batch > 1 else "jitter", mean_s, max(bands), batch, batch, usual_s)


def _expected(one_s: float, other_s: float, declared_s: float | None) -> bool:
    """Return whether the declared period agrees with the first of two periods and not with the other."""
    if declared_s is None:
        return False
    return abs(one_s / declared_s - 1.0) < 0.05 and abs(other_s / declared_s - 1.0) >= 0.05


def _chunks(stretches: Sequence[Array], rows: int) -> list[Array]:
    """Split stretches into whole chunks of a length, or keep them where they are shorter."""
    found = [t[a : a + rows] for t in stretches for a in range(0, len(t) - rows + 1, rows)]
    return found or [t for t in stretches if len(t) > 1]


def _mean_step(stretches: Sequence[Array]) -> float:
    """The mean step of most chunks: a pause or a lost row is in few of them."""
    rows = sum(len(t) for t in stretches)
    usual = LONG_CHUNK if rows >= 8 * LONG_CHUNK else max(CHUNK, rows // 8)
    chunks = _chunks(stretches, max(usual, STAMPS * _shared(stretches)))
    means = np.array([(t[-1] - t[0]) / (len(t) - 1) for t in chunks])
    return float(np.median(means))


def _shared(stretches: Sequence[Array]) -> int:
    """Number of rows that share a stamp, on the average."""
    moving = sum(int(np.count_nonzero(np.diff(t))) for t in stretches)
    return sum(len(t) for t in stretches) // max(moving, 1)


def _shortest_usual(steps: Array) -> float:
    """The step that a quarter of the steps are shorter than, and those like it; stamps that are shared are no step."""
    moving = steps[steps > 0.0]
    base = float(np.quantile(moving, 0.25, method="lower"))
    return float(np.median(moving[np.abs(moving - base) <= 0.2 * base]))


def _share_near(steps: Array, period_s: float, tolerance: float) -> float:
    return float(np.mean(np.abs(steps - period_s) <= tolerance * period_s))


def _refined(stretches: Sequence[Array], base_s: float, tolerance: float) -> float:
    """The period over chunks in which nothing is missing, by the whole numbers that their steps are of the base."""
    periods: list[float] = []
    for t in _chunks(stretches, CHUNK):
        steps = np.diff(t)
        if np.all(np.abs(steps - base_s) <= 2.0 * tolerance * base_s):
            periods.append(float(t[-1] - t[0]) / len(steps))
    return float(np.median(periods)) if periods else base_s


def _coarse_period(stretches: Sequence[Array], resolution_s: float, mean_s: float) -> float | None:
    """The period where most chunks are uniform up to the clock's resolution, and show it; else None.

    Rounding makes the steps of a uniform clock two neighbours. Steps that are all equal say nothing of the resolution:
    that of stamps at whole multiples of the period is their period, for all that can be seen.
    """
    chunks = _chunks(stretches, CHUNK)
    rows = min(len(t) for t in chunks)
    if rows < 3:
        return None
    times = np.array([t[:rows] for t in chunks])
    ranges = np.ptp(np.diff(times, axis=1), axis=1)
    slopes, residuals = _lines(times)
    within = (ranges <= 1.01 * resolution_s) & (np.max(np.abs(residuals), axis=1) <= COARSE * resolution_s)
    shown = within & (ranges >= 0.5 * resolution_s)
    if 2 * np.count_nonzero(within) <= len(chunks) or 2 * np.count_nonzero(shown) <= np.count_nonzero(within):
        return None
    short_s = float(np.median(slopes[within]))  # lost rows are in few of the chunks, but each is short
    if abs(mean_s / short_s - 1.0) < LONG_AND_SHORT or resolution_s < short_s:
        return mean_s if abs(mean_s / short_s - 1.0) < LONG_AND_SHORT else short_s
    long = _chunks(stretches, LONG_CHUNK)
    slopes, _ = _lines(np.array([t[: min(len(t) for t in long)] for t in long]))
    return float(np.median(slopes))


def _jitter_period(stretches: Sequence[Array], mean_s: float) -> float:
    """The period of short chunks, where the mean step of long ones is longer for the rows that are lost in most."""
    chunks = _chunks(stretches, max(CHUNK, STAMPS * _shared(stretches)))
    rows = min(len(t) for t in chunks)
    slopes, _ = _lines(np.array([t[:rows] for t in chunks]))
    short_s = float(np.median(slopes))
    scatter = 1.5 * float(np.median(np.abs(slopes - short_s))) / np.sqrt(len(slopes))
    return short_s if mean_s - short_s > max(LONG_AND_SHORT * short_s, 3.0 * scatter) else mean_s


def _lines(times: Array) -> tuple[Array, Array]:
    """Slope (m,) and residuals (m, n) of a straight line through each row of stamps (m, n)."""
    k = np.arange(times.shape[1]) - 0.5 * (times.shape[1] - 1)
    centred = times - times.mean(axis=1, keepdims=True)
    slopes = centred @ k / float(k @ k)
    return slopes, centred - slopes[:, None] * k


def _is_lattice(steps: Array, base_s: float, tolerance: float, resolution_s: float) -> bool:
    """Return whether steps are whole multiples of a base, and the base itself the most frequent of them."""
    if 3.0 * resolution_s > base_s and np.mean(steps < (1.0 - tolerance) * base_s) > CLEAN:
        return False
    multiples = np.rint(steps / base_s)
    on = (multiples >= 1.0) & (np.abs(steps / base_s - multiples) <= tolerance)
    return bool(np.mean(on) >= ON_LATTICE and np.mean(on & (multiples == 1.0)) >= SINGLE)


def _batch(steps: Array, mean_s: float) -> int:
    """Number of rows that come together, by the usual distance of long steps; 1: no order is visible."""
    long = np.flatnonzero(steps > 1.25 * mean_s)
    if len(long) < 4:
        return 1
    apart = np.diff(long)
    usual = int(np.median(apart))
    sizes = steps[long]
    like = np.abs(sizes / float(np.median(sizes)) - 1.0) <= 0.2
    beside = 1 if usual >= MANY else 0  # the period of a coarse clock is no whole number of samples
    if usual < 2 or np.mean(np.abs(apart - usual) <= beside) < REGULAR or np.mean(like) < REGULAR:
        return 1
    return usual


def _batch_period(stretches: Sequence[Array], mean_s: float) -> float:
    """The period from the beginning of one batch to that of the sixteenth after it, in most cases."""
    periods: list[float] = []
    for t in stretches:
        begins = np.flatnonzero(np.diff(t) > 1.25 * mean_s) + 1
        marks = begins[:: min(16, max(1, len(begins) // 2))]
        periods += (np.diff(t[marks]) / np.diff(marks)).tolist()
    return float(np.median(periods)) if periods else mean_s
