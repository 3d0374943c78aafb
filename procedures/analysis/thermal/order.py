"""Order of a polynomial of temperature, 1 … 5: tests on cells whitened by the fit's own noise (thesis appendix B)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from procedures.core.arrays import Array

LARGEST_ORDER = 5
"""Greatest order that is tried, as in the thesis's program (appendix B, `approxPart`)."""


@dataclass(frozen=True)
class Order:
    """Comparison of the orders 1, 2, …, all on the same cells, whitened where the fit was."""

    bic: tuple[float, ...]
    """Bayesian information criterion of each order: ``n_e·ln(rss/m) + k·ln n_e``, n_e the effective samples."""
    p_value: tuple[float, ...]
    """F test of order 2 against 1, of 3 against 2, …: the chance of as much gain from noise alone."""

    @property
    def preferred(self) -> int:
        """The order of the least criterion."""
        return 1 + int(np.argmin(self.bic))

    def reason(self, used: int) -> str:
        """Return the reason for or against a used order, in one sentence."""
        tests = ", ".join(f"{k + 1} against {k} p = {p:.2g}" for k, p in enumerate(self.p_value, start=1))
        best = self.preferred
        least = min(self.bic)
        told = "the criterion is least there" if best == used else f"the criterion is least at order {best}"
        margin = (
            min((b - least for k, b in enumerate(self.bic, start=1) if k != best), default=0.0)
            if best == used
            else (self.bic[used - 1] - least)
        )
        return f"order {used}: {told}, by {margin:.3g}; F tests: {tests}"


def compare_orders(
    columns: Array, sets: Sequence[Sequence[int]], values: Array, effective_samples: float, independent: float
) -> Order:
    """Compare nested sets of the columns (m, k), one an order, by what each leaves of the values (m,).

    `independent`: number of independent values that the F tests count with.
    """
    scaled = columns / np.linalg.norm(columns, axis=0)
    left: list[float] = []
    ranks: list[int] = []
    for chosen in sets:
        design = scaled[:, list(chosen)]
        solution, _, rank, _ = np.linalg.lstsq(design, values, rcond=1e-12)
        left.append(max(float(np.sum((values - design @ solution) ** 2)), 1e-300))
        ranks.append(int(rank))
    m, n_e = len(values), effective_samples
    bic = tuple(n_e * float(np.log(r / m)) + k * float(np.log(n_e)) for r, k in zip(left, ranks, strict=True))
    p_values = tuple(f_test(left[i], left[i + 1], ranks[i], ranks[i + 1], independent) for i in range(len(left) - 1))
    return Order(bic, p_values)


def f_test(fewer: float, more: float, k_fewer: int, k_more: int, count: float) -> float:
    """Return the p-value of ``F = ((rss₁ − rss₂)/(k₂ − k₁))/(rss₂/(m − k₂))``, m independent values; 1 where it says
    nothing.
    """
    if count <= k_more or k_more <= k_fewer:
        return 1.0
    statistic = (fewer - more) / (k_more - k_fewer) / (more / (count - k_more))
    return float(fdtrc(k_more - k_fewer, count - k_more, max(statistic, 0.0)))
