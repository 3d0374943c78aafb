"""What the rate follows beside a ramp: regressors of the slow part, each kept where the noise does not explain it.

A drift that a temperature beside the channel explains is neither a random walk of the rate nor a ramp; nor is a shift
of the level. Each is tested with all noise processes allowed, so that a random walk which merely looks like it does
not pass (Student's distribution with Satterthwaite's degrees of freedom, see `selection`), and without a ramp: what
explains a drift is preferred to a drift without a cause.
"""

from collections.abc import Sequence

import numpy as np

from procedures.analysis.noise_fit.estimate import Followed
from procedures.analysis.noise_fit.joined import Joined
from procedures.analysis.noise_fit.restricted import maximum
from procedures.analysis.noise_fit.selection import ENDS, RAMP, slope_of
from procedures.core.arrays import Array

_WIDTHS = (4, 16, 64, 256, 1024)
"""Cells before and after a shift whose means are compared."""
_NORMAL_MAD = 0.6745


def followed(joined: Joined, levels: Sequence[float]) -> tuple[Joined, tuple[Followed, ...]]:
    """The bins with the regressors that matter, and what they do; `levels` are the tests' probabilities, one each.

    The least significant is left out first, until all that are left pass.
    """
    first = len(ENDS) + 1
    kept = list(range(len(levels)))
    while kept:
        reduced = joined.with_regressors([*ENDS, *(first + i for i in kept)])
        best = maximum(reduced.used, range(reduced.spectrum.columns.shape[1]))
        slopes = [slope_of(reduced.used, best, len(ENDS) + k) for k in range(len(kept))]
        over = [s.p_value / levels[i] for s, i in zip(slopes, kept, strict=True)]
        worst = int(np.argmax(over))
        if over[worst] < 1.0:
            found = tuple(
                Followed(i, s.slope, s.standard_uncertainty, s.p_value) for i, s in zip(kept, slopes, strict=True)
            )
            return joined.with_regressors([RAMP, *ENDS, *(first + i for i in kept)]), found
        del kept[worst]
    return joined.with_regressors([RAMP, *ENDS]), ()


def likeliest_shift(cells: Array) -> int | None:
    """The cell before which the level of (n,) most likely shifts; None where there are too few cells to tell.

    The difference of means before and after stands out most from such differences elsewhere, for some width.
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
