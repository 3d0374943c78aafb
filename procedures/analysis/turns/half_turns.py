"""Gyros alone, turned by half a turn about the vertical and back: half sums are the bias, half differences the input.

A level gyro reads ``b + Ω·cos φ·cos ψ`` at a heading ψ and ``b − Ω·cos φ·cos ψ`` half a turn on. Each pair of dwells
that follow one another gives one half difference; what the bias wanders between the two is in it, so the scatter of
the pairs is the uncertainty, and the noise within the dwells is only its floor. Pairs do not overlap: under a bias that
wanders at random they are independent.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording

PAIRS_MIN = 3
"""Least number of pairs for a meaningful scatter."""


@dataclass(frozen=True)
class HalfTurns:
    """Half differences and half sums of three gyros, each (3,) [rad/s]."""

    half_difference: Array
    """Input of each channel at the unturned heading: its component of the Earth's rate."""
    half_difference_sd: Array
    """Standard uncertainty from the scatter of the pairs."""
    within_sd: Array
    """Standard uncertainty expected from the noise within the dwells alone."""
    bias: Array
    """Bias estimate, the half sum; that of the vertical channel includes the Earth's vertical rate."""
    bias_sd: Array
    """Standard uncertainty of the mean over the series, from the scatter of the half sums."""
    pairs: int

    def coverage_factor(self, confidence: float) -> float:
        """Return Student's factor of an interval of that confidence (two-sided)."""
        return float(stdtrit(self.pairs - 1, 0.5 + 0.5 * confidence))


def half_turns(means: Array, mean_sd: Array, turned: NDArray[np.bool_]) -> HalfTurns:
    """Return half differences and half sums from the means (n, 3) of dwells, in the order they were made, with
    uncertainties (n, 3) and turned headings.

    Each dwell pairs with the next if that is at the other heading. Raises `UnfitRecording` of too few pairs.
    """
    firsts: list[int] = []
    k = 0
    while k + 1 < len(turned):
        if turned[k] != turned[k + 1]:
            firsts.append(k)
            k += 1
        k += 1
    if len(firsts) < PAIRS_MIN:
        raise UnfitRecording(
            f"{len(turned)} recordings give {len(firsts)} pairs of opposite headings, at least {PAIRS_MIN} are needed: "
            "turn the unit by half a turn and back between the recordings"
        )
    first = np.array(firsts)
    sign = np.where(turned[first], -1.0, 1.0)[:, None]
    differences = 0.5 * sign * (means[first] - means[first + 1])
    sums = 0.5 * (means[first] + means[first + 1])
    within = 0.25 * np.sum(mean_sd[first] ** 2 + mean_sd[first + 1] ** 2, axis=0)
    pairs = len(first)
    return HalfTurns(
        differences.mean(axis=0),
        differences.std(axis=0, ddof=1) / np.sqrt(pairs),
        np.sqrt(within) / pairs,
        sums.mean(axis=0),
        sums.std(axis=0, ddof=1) / np.sqrt(pairs),
        pairs,
    )


def level_rate(first: float, second: float, first_sd: float, second_sd: float) -> tuple[float, float]:
    """Horizontal rate and its standard uncertainty from two half differences at right angles [rad/s].

    ``r = √(x² + y²) − u⊥²/2r``: noise across the rate lengthens it, by u⊥²/2r on average (u⊥ its uncertainty there).
    """
    size = float(np.hypot(first, second))
    if size == 0.0:
        return 0.0, float(np.hypot(first_sd, second_sd))
    along = float(np.hypot(first * first_sd, second * second_sd)) / size
    across = float(np.hypot(second * first_sd, first * second_sd)) / size
    return max(size - across**2 / (2.0 * size), 0.0), along
