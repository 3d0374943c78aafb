"""Channels that repeat another one: each sample is the other's times a factor, exactly.

Two sensors never agree to rounding, however strongly the same motion moves them: each has noise of its own. So a pair
that keeps one ratio of differences through a whole recording is one sensor in two places, as it is, negated or scaled.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.fitness.pieces import Samples
from procedures.core.arrays import Array
from procedures.core.recording import AROUND, Channel

EXACT, EXACT_COUNTS = 1e-4, 1e-12
"""Greatest departure of a difference from the ratio, relative to the largest: numbers are printed with few digits,
while counts have all of theirs."""
LOOK = 256
"""Number of first differences of a piece that are enough to rule out nearly all pairs."""
LEAST_CHANGES, LEAST_SIZES = 20, 5
"""Fewest changes of a pair, and fewest different sizes of them, that are no coincidence of a few counts."""


@dataclass(frozen=True)
class Twin:
    """A channel that repeats an earlier one: both columns, and the ratio of their differences in raw units."""

    column: int
    of: int
    ratio: float


class Twins:
    """Running comparison of all pairs of channels that are not yet told apart."""

    def __init__(self, channels: Sequence[Channel]) -> None:
        """Start with no samples; temperatures and angles of the table may well be sent twice."""
        rows = [c for c, channel in enumerate(channels) if channel.quantity not in AROUND]
        self._ratio: dict[tuple[int, int], float | None] = {(i, j): None for i in rows for j in rows if i < j}
        self._changes = dict.fromkeys(rows, 0)
        self._sizes: dict[int, set[float]] = {c: set() for c in rows}

    def add(self, d: Samples) -> None:
        """Take in differences between neighbouring samples, (channels, n)."""
        if not self._ratio or not d.shape[1]:
            return
        exact = EXACT_COUNTS if np.issubdtype(d.dtype, np.integer) else EXACT
        rows = sorted({c for pair in self._ratio for c in pair})
        self._part(dict(zip(rows, d[rows, :LOOK].astype(np.float64), strict=True)), exact)
        if not self._ratio:
            return
        left = sorted({c for pair in self._ratio for c in pair})
        differences = dict(zip(left, d[left].astype(np.float64), strict=True))
        self._part(differences, exact)
        for c, row in differences.items():
            self._changes[c] += int(np.count_nonzero(row))
            if len(self._sizes[c]) < LEAST_SIZES:
                self._sizes[c].update(np.unique(row)[: 2 * LEAST_SIZES].tolist())

    def found(self) -> list[Twin]:
        """Return each channel that repeats an earlier one, by column."""
        first: dict[int, Twin] = {}
        for (i, j), ratio in sorted(self._ratio.items()):
            enough = min(self._changes[i], self._changes[j]) >= LEAST_CHANGES
            if ratio is not None and enough and len(self._sizes[i]) >= LEAST_SIZES:
                first.setdefault(j, Twin(j, i, ratio))
        return list(first.values())

    def _part(self, rows: dict[int, Array], exact: float) -> None:
        """Drop the pairs whose differences are not in one ratio; a channel at rest agrees with one at rest."""
        for pair, known in list(self._ratio.items()):
            one, other = rows[pair[0]], rows[pair[1]]
            at = int(np.argmax(np.abs(one)))
            if one[at] == 0.0:
                kept = not np.any(other)
            else:
                ratio = float(other[at] / one[at]) if known is None else known
                allowed = exact * max(abs(ratio * float(one[at])), float(np.max(np.abs(other))))
                with np.errstate(over="ignore", invalid="ignore"):
                    kept = ratio != 0.0 and bool(np.all(np.abs(other - ratio * one) <= allowed))
                self._ratio[pair] = ratio
            if not kept:
                del self._ratio[pair]
