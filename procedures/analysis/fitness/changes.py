"""Abrupt changes in series of cell means: steps, distinguished from drift, slow noise of any colour, and outliers.

At every border k between two cells a line is fitted to the h cells on either side; where the two lines meet the border
they differ by the gap G_h(k), which is zero for a straight drift. The spread of G_h over the whole series is that of
its own noise at that scale, white or slow, so a gap counts only where it is many times it. A step opens the
same gap at every scale, a bend one that grows with h: so a quarter of the cells must show half of it, and the medians
on either side as well, which an outlier does not move.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.core.arrays import Array

SIGNIFICANT, FLAT = 8.0, 7.0
"""Default least gap of lines, and of means, in spreads. The spread of a short
series is known to 20 %; 10 000 borders and scales of a recording then give a false alarm in some thousands."""
SHORTEST = 4
"""Fewest cells on either side of a border."""
POSITIONS = 16
"""Stretches of h cells that a series must have for its spread to be known."""
QUANTILE, NORMAL = 0.8, 1.2815515655446004
"""The spread is taken from this quantile of the magnitudes: one step in sixteen positions hardly moves it."""
SHARP = 0.5
"""Part of a gap that must be there at a quarter of the scale, and between the medians."""
SEEN = 6.0
"""Least step, in spreads at a scale, that is detectable at that scale."""
ROUNDING = 1e-12
"""Least spread relative to the greatest gap, for a series that is zero nearly everywhere."""
MOST = 12
"""Most steps of one series that are separated."""
TRIES = 40


@dataclass(frozen=True)
class Change:
    """One step in a series: the index of the cell where it happens, and its height."""

    index: int
    """The first cell after the step."""
    height: float


def changes(
    series: Array, floor: Array, uneven: Array | None = None, *, flat: bool = False, least: float | None = None
) -> list[list[Change]]:
    """Return the steps of each row of `series` (channels, K), none smaller than its `floor` (channels,), in order.

    `uneven` (channels, K), at least 1: ratio of a row's noise at each cell to its usual noise; a gap counts the less.
    `least`: required gap in spreads. `flat`: the series does not drift, and means replace the lines, which makes the
    gap twice as certain.
    """
    found: list[list[Change]] = [[] for _ in series]
    if series.shape[1] < POSITIONS * SHORTEST:
        return found
    centred = series - np.median(series, axis=1, keepdims=True)
    most = np.zeros(len(series))
    sums = _Sums.of(centred)
    for h in _scales(series.shape[1]):
        gaps = np.abs(_gaps(sums, h, flat))
        most = np.maximum(most, np.max(gaps / _spread(gaps)[:, None], axis=1, initial=0.0))
    least = (FLAT if flat else SIGNIFICANT) if least is None else least
    for c in np.flatnonzero(most > least):
        found[c] = _of_row(
            centred[c], float(floor[c]), np.ones(series.shape[1]) if uneven is None else uneven[c], flat, least
        )
    return found


def _scales(cells: int) -> list[int]:
    return [1 << j for j in range(2, 20) if POSITIONS << j <= cells]


@dataclass(frozen=True)
class _Sums:
    """Σy and Σy·j over the cells before each border, (channels, K + 1), for all scales."""

    total: Array
    moment: Array

    @classmethod
    def of(cls, y: Array) -> "_Sums":
        zero, j = np.zeros((len(y), 1)), np.arange(y.shape[1], dtype=np.float64)
        return cls(np.hstack([zero, np.cumsum(y, axis=1)]), np.hstack([zero, np.cumsum(y * j, axis=1)]))


def _gaps(sums: _Sums, h: int, flat: bool) -> Array:
    """G_h at the borders h … K − h, (channels, K − 2h + 1)."""
    s0, s1, cells = sums.total, sums.moment, sums.total.shape[1] - 1
    before, here, after = slice(0, cells - 2 * h + 1), slice(h, cells - h + 1), slice(2 * h, cells + 1)
    left, right = s0[:, here] - s0[:, before], s0[:, after] - s0[:, here]
    if flat:
        return (right - left) / h
    k = np.arange(h, cells - h + 1)
    near_left = (k - 0.5) * left - (s1[:, here] - s1[:, before])
    near_right = s1[:, after] - s1[:, here] - (k - 0.5) * right
    return _intercept(right, near_right, h) - _intercept(left, near_left, h)


def _intercept(total: Array, moment: Array, h: int) -> Array:
    """Value at the border of the line through h cells: total Σy and moment Σy·u, u the distance from the border."""
    mean = total / h
    slope = (moment / h - mean * h / 2.0) / ((h * h - 1.0) / 12.0)
    return mean - slope * h / 2.0


def _spread(gaps: Array) -> Array:
    """Standard deviation (channels,) of noise with the quantile of these magnitudes."""
    at = min(int(QUANTILE * gaps.shape[1]), gaps.shape[1] - 1)
    least = np.maximum(ROUNDING * gaps.max(axis=1), np.finfo(np.float64).tiny / ROUNDING)
    return np.maximum(np.partition(gaps, at, axis=1)[:, at] / NORMAL, least)


def _of_row(y: Array, floor: float, uneven: Array, flat: bool, least: float) -> list[Change]:
    """Find the steps of one row, the largest first; each is removed before the next is sought."""
    y = y.copy()
    found: list[Change] = []
    barred = np.zeros(len(y) + 1, np.bool_)
    usual = {h: np.maximum(_beside(uneven, h), 1.0) for h in _scales(len(y))}
    scales = _all_scales(y, usual, flat)
    for _ in range(TRIES):
        best = _best(scales, barred, least)
        if best is None or len(found) >= MOST:
            break
        k, h = best
        height = _height(y, k, h, flat)
        if abs(height) >= floor and _is_step(y, k, h, height) and _is_sharp(scales, k, height):
            found.append(Change(k, height))
            y[k:] -= height
            # The step lies within one of the cells at the border, which would pass for an outlier.
            y[k - 1], y[k] = np.median(y[max(k - 5, 0) : k - 1]), np.median(y[k + 1 : k + 5])
            barred[max(k - SHORTEST // 2, 0) : k + SHORTEST // 2] = True
            scales = _all_scales(y, usual, flat)
        else:
            barred[max(k - h // 2, 0) : k + h // 2 + 1] = True
    return sorted(found, key=lambda change: change.index)


@dataclass(frozen=True)
class _Scale:
    """The gaps of one row at one scale, and the spread of each border, (K − 2h + 1,)."""

    h: int
    gaps: Array
    spread: Array


def _all_scales(y: Array, usual: Mapping[int, Array], flat: bool) -> list[_Scale]:
    """The gaps of a row at all scales; `usual`: ratio of the noise at each border to its usual one, by scale."""
    sums = _Sums.of(y[None])
    gaps = {h: _gaps(sums, h, flat) for h in usual}
    return [_Scale(h, gaps[h][0], float(_spread(np.abs(gaps[h]))[0]) * usual[h]) for h in usual]


def _best(scales: Sequence[_Scale], barred: NDArray[np.bool_], most: float) -> tuple[int, int] | None:
    """Border and scale of the gap that exceeds its spread most; None where none does."""
    best = None
    for scale in scales:
        score = np.abs(scale.gaps) / scale.spread
        score[barred[scale.h : len(score) + scale.h]] = 0.0
        at = int(np.argmax(score))
        if score[at] > most:
            best, most = (at + scale.h, scale.h), float(score[at])
    return best


def _is_sharp(scales: Sequence[_Scale], k: int, height: float) -> bool:
    """True if the least scale that could show the gap does; that of a bend or of a transient does not appear there."""
    for scale in scales:
        near = slice(max(k - 1 - scale.h, 0), k + 2 - scale.h)
        gaps, spread = scale.gaps[near], scale.spread[near]
        if len(gaps) and abs(height) > SEEN * float(spread.max()):
            return bool(np.max(gaps * np.sign(height)) > SHARP * abs(height))
    return True


def _beside(uneven: Array, h: int) -> Array:
    """The greater of the means over the h cells on either side of each border."""
    s = np.concatenate([[0.0], np.cumsum(uneven)])
    k = np.arange(h, len(uneven) - h + 1)
    return np.maximum(s[k] - s[k - h], s[k + h] - s[k]) / h


def _height(y: Array, k: int, h: int, flat: bool) -> float:
    """The gap at border k without the two adjacent cells, either of which may contain the step."""
    u = np.arange(1, h, dtype=np.float64) + 0.5
    left, right = y[k - h : k - 1][::-1], y[k + 1 : k + h]
    apart = float(right.mean() - left.mean())
    return apart if flat else apart - float((_slope(u, right) - _slope(u, left)) * u.mean())


def _is_step(y: Array, k: int, h: int, height: float) -> bool:
    """True if the gap also appears at a quarter of the scale and between the medians."""
    near = _near(y, k, max(1, h // 4), height)
    u = np.arange(h, dtype=np.float64) + 0.5
    left, right = y[k - h : k][::-1], y[k : k + h]
    slope = 0.5 * (_slope(u, right) - _slope(u, left))
    apart = float(np.median(right - slope * u) - np.median(left + slope * u))
    return near >= SHARP * abs(height) and apart * np.sign(height) >= SHARP * abs(height)


def _near(y: Array, k: int, q: int, height: float) -> float:
    """The jump over the q cells on either side, less the usual jump nearby; the two cells at the border are left out,
    since a step may lie within either.
    """
    here = _jump(y, k, q)
    beside = [j for j in (k - q - 2, k + q + 2) if q + 1 <= j <= len(y) - q - 1]
    usual = float(np.mean([_jump(y, j, q) for j in beside])) if beside else 0.0
    return (here - usual) * float(np.sign(height))


def _jump(y: Array, k: int, q: int) -> float:
    left, right = y[max(k - 1 - q, 0) : max(k - 1, 1)], y[min(k + 1, len(y) - 1) : k + 1 + q]
    return float(right.mean() - left.mean())


def _slope(u: Array, y: Array) -> float:
    return float(np.dot(u - u.mean(), y) / np.dot(u - u.mean(), u - u.mean()))
