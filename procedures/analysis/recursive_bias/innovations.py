"""Innovations of a recursive estimate as a test of its channel: does the filter see what it expects (textbook S 5.4.3)?

A normalised innovation is unit normal where the channel is as its noise record says, and independent of the others; so
the sum of n squares (normalised innovation squared) is chi-square of n degrees of freedom. A channel that is noisier,
steps, drifts or drops out makes it too large; one that is held, filtered or clipped makes it too small. A channel that
wanders may hide there: its neighbouring innovations are alike, and their products show it. (One that stands still at
a likely value is found by the inspection of the samples, not here.)
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtr, chdtrc, ndtr

from procedures.core.arrays import Array

STRETCHES = 20
"""Stretches in which a fault's beginning is looked for."""


@dataclass(frozen=True)
class InnovationTest:
    """Test of one channel's innovations: their size and their whiteness."""

    mean_square: float
    """Mean normalised innovation squared; 1 is expected."""
    degrees_of_freedom: int
    correlation: float
    """Mean product of neighbouring innovations; 0 is expected."""
    size_p_value: float
    """Chance of a sum of squares so far from its expectation, to either side, by a channel as recorded."""
    whiteness_p_value: float
    """Chance of so large a mean product, of either sign, by a channel as recorded."""
    since_s: float | None
    """Beginning of the first stretch that alone is too large or too small, after the first measurement; None: none."""

    @property
    def p_value(self) -> float:
        """P-value of both tests: the smaller one, doubled (Bonferroni)."""
        return min(1.0, 2.0 * min(self.size_p_value, self.whiteness_p_value))

    def sentence(self, level: float) -> str:
        """Return a sentence on a channel that fails at a level; empty for one that does not."""
        if self.p_value >= level:
            return ""
        spread = float(np.sqrt(2.0 / self.degrees_of_freedom))
        kind = "larger" if self.mean_square > 1.0 else "smaller"
        if self.whiteness_p_value < self.size_p_value:
            return (
                f"innovations that depend on one another: mean product {self.correlation:.2g} of neighbours, 0 ± "
                + (f"{1.0 / np.sqrt(self.degrees_of_freedom):.2g} expected (p = {self.p_value:.1g})")
            )
        since = "" if self.since_s is None else f", beginning about {self.since_s:.3g} s"
        return (
            f"innovations {kind} than its noise allows: normalised innovation squared {self.mean_square:.3g}, 1 ± "
            f"{spread:.2g} expected (p = {self.p_value:.1g}){since}"
        )


def innovation_test(innovations: Array, length_s: float, level: float) -> InnovationTest:
    """Test normalised innovations (n,) of measurements of `length_s` against chi-square, two-sided.

    `since_s` is looked for stretch by stretch at `level` over their number (Bonferroni).
    """
    n = len(innovations)
    if n == 0:
        return InnovationTest(1.0, 0, 0.0, 1.0, 1.0, None)
    total = float(innovations @ innovations)
    parts = np.array_split(np.arange(n), min(STRETCHES, max(1, n // 5)))
    alone = [two_sided(float(innovations[part] @ innovations[part]), len(part)) for part in parts]
    first = next((part[0] for part, p in zip(parts, alone, strict=True) if p < level / len(parts)), None)
    product = float(innovations[1:] @ innovations[:-1]) / max(1, n - 1)
    since = None if first is None else float(first) * length_s
    return InnovationTest(total / n, n, product, two_sided(total, n), _white(product, n - 1), since)


def _white(mean_product: float, count: int) -> float:
    """Chance of so large a mean of `count` products of unit normal neighbours: uncorrelated, each of variance one."""
    return float(2.0 * ndtr(-abs(mean_product) * np.sqrt(count))) if count > 0 else 1.0


def two_sided(statistic: float, degrees_of_freedom: int) -> float:
    """Return the probability that chi-square lies as far out on either side."""
    below, above = chdtr(degrees_of_freedom, statistic), chdtrc(degrees_of_freedom, statistic)
    return float(min(1.0, 2.0 * min(below, above)))
