"""Regressors of the slow rate other than a ramp, each kept where the noise does not explain its effect.

A drift that a recorded temperature explains is neither a rate random walk nor a ramp; nor is a shift of the level. A
regressor is kept if it passes either of two tests. With all noise processes allowed, its slope has Student's
distribution with Satterthwaite's degrees of freedom (see `selection`): a random walk that merely resembles it does not
pass. Without rate random walk and ramp, it must explain the record better than these two do without the regressor.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.noise_fit.columns import RATE_RANDOM_WALK
from procedures.analysis.noise_fit.estimate import Followed
from procedures.analysis.noise_fit.joined import Joined
from procedures.analysis.noise_fit.restricted import State, maximum
from procedures.analysis.noise_fit.selection import ENDS, RAMP, Slope, slope_of
from procedures.core.arrays import Array

_WIDTHS = (4, 16, 64, 256, 1024)
"""Cells before and after a shift whose means are compared."""
_NORMAL_MAD = 0.6745
_FIRST = len(ENDS) + 1


@dataclass(frozen=True)
class Candidate:
    """Conditions under which a regressor is kept: level of significance, and gain."""

    level: float
    """Probability of the test of its slope."""
    gain: float
    """Required gain in twice the log likelihood over drifting noise."""


def followed(joined: Joined, candidates: Sequence[Candidate]) -> tuple[Joined, tuple[Followed, ...]]:
    """The bins with the regressors that are kept, and the fitted slopes of these.

    The least significant regressor is removed first, until all that remain pass.
    """
    kept = list(range(len(candidates)))
    while kept:
        slopes, instead = _slopes(joined, kept), _instead(joined, kept)
        passed = [_passes(i, kept, slopes, instead, candidates[i]) for i in kept]
        if all(passed):
            found = tuple(
                Followed(i, s.slope, s.standard_uncertainty, s.p_value) for i, s in zip(kept, slopes, strict=True)
            )
            return joined.with_regressors([RAMP, *ENDS, *(_FIRST + i for i in kept)]), found
        over = [0.0 if ok else s.p_value / candidates[i].level for ok, s, i in zip(passed, slopes, kept, strict=True)]
        del kept[int(np.argmax(over))]
    return joined.with_regressors([RAMP, *ENDS]), ()


def _passes(i: int, kept: list[int], slopes: list[Slope], instead: dict[int, float], candidate: Candidate) -> bool:
    return slopes[kept.index(i)].p_value < candidate.level or instead[i] > candidate.gain


def _slopes(joined: Joined, kept: list[int]) -> list[Slope]:
    """Slopes with all processes allowed and no ramp: a drift with a known cause is preferred to a ramp."""
    reduced = joined.with_regressors([*ENDS, *(_FIRST + i for i in kept)])
    best = maximum(reduced.used, range(reduced.spectrum.columns.shape[1]))
    return [slope_of(reduced.used, best, len(ENDS) + k) for k in range(len(kept))]


def _instead(joined: Joined, kept: list[int]) -> dict[int, float]:
    """Twice the gain in log likelihood of each, without rate random walk and ramp, over these two without it."""
    still = [k for k in range(joined.spectrum.columns.shape[1]) if k != RATE_RANDOM_WALK]
    own = _plain(joined, [*ENDS, *(_FIRST + i for i in kept)], still)
    return {i: 2.0 * (own - _drifting(joined, [j for j in kept if j != i])) for i in kept}


def _drifting(joined: Joined, others: list[int]) -> float:
    rows = [_FIRST + j for j in others]
    everything = list(range(joined.spectrum.columns.shape[1]))
    return max(_plain(joined, [*ENDS, *rows], everything), _plain(joined, [RAMP, *ENDS, *rows], everything))


def _plain(joined: Joined, regressors: list[int], free: list[int]) -> float:
    state: State = maximum(joined.with_regressors(regressors).used, free)
    return state.plain_log_likelihood


def likeliest_shift(cells: Array) -> int | None:
    """The cell before which the level of (n,) most likely shifts; None where there are too few cells.

    There the difference of the means before and after is greatest, relative to those elsewhere, for some width.
    """
    n = len(cells)
    sums = np.concatenate([[0.0], np.cumsum(cells - np.mean(cells))])
    found: list[tuple[float, int]] = []
    for width in _WIDTHS:
        if n < 8 * width:
            break
        at = np.arange(width, n - width + 1)
        difference = np.abs(sums[at + width] - 2.0 * sums[at] + sums[at - width])
        scale = float(np.median(difference)) / _NORMAL_MAD
        if scale > 0.0:
            best = int(np.argmax(difference))
            found.append((float(difference[best]) / scale, int(at[best])))
    return max(found)[1] if found else None
