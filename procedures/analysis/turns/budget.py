"""Uncertainty budget of each coefficient from whole turns: noise process by process, and each flaw of the table.

A flaw p changes the integrated outputs by ``δy = K·∂v/∂p·δp`` with v the turned angle and the Earth's turn together
(`turns.fit.turn_flaws`); the estimator's gain G carries both into the coefficients, ``c² = |G·δy|²``, and a noise
process of covariance C of the means gives ``c² = diag(G·T·C·T·Gᵀ)``, T the lengths of the recordings. The contributions
are those of the stated uncertainty: their root sum of squares is the total. Cross-coupling is no row of its own: it is
the sensitivity by which the right angles reach a scale factor.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from procedures.analysis.calibration.budget import (
    OBSERVED,
    Budget,
    Part,
    budget_of,
    declared_value,
    noise_parts,
    part_rows,
    row_of,
)
from procedures.analysis.calibration.table_errors import TableErrors
from procedures.analysis.turns.fit import UNKNOWN_NOISE_SD, TurnFit
from procedures.core.arrays import Array
from procedures.core.coefficient_name import CoefficientName
from procedures.core.unit import TriadRecord


def turn_parts(record: TriadRecord | None, windows: Array) -> list[Part]:
    """Return the noise of the integrated outputs [rad] of recordings that last `windows` (n, 2), process by process.
    None: no noise is known, and there are no parts.
    """
    if record is None:
        return []
    seconds = windows[:, 1] - windows[:, 0]
    size = np.outer(seconds, seconds)
    return [replace(p, covariance=p.covariance * size) for p in noise_parts(record, windows, "rad/s")]


def turn_budgets(
    fit: TurnFit, names: Sequence[CoefficientName], parts: Sequence[Part], flaws: TableErrors
) -> tuple[Budget, ...]:
    """Return the budget of each coefficient, in the order of `names`; without `parts` the noise is that of the
    residuals.
    """
    made = fit.estimator
    of_parts = part_rows(parts, made.gain.reshape(len(names), 3, -1))
    sources = [s for s in dict.fromkeys(made.source) if np.any(made.of_source(s) > 0.0)]
    of_table = {s: (declared_value(flaws, s), made.of_source(s)) for s in sources}
    observed = np.sqrt(np.diagonal(fit.noise_covariance))
    scale = float(np.sqrt(fit.chi_square / fit.degrees_of_freedom)) if fit.degrees_of_freedom else 1.0
    found: list[Budget] = []
    for i, name in enumerate(names):
        rows = of_parts[i]
        if not parts:
            freedom = float(max(1, fit.degrees_of_freedom))
            rows = [row_of(OBSERVED, scale * UNKNOWN_NOISE_SD, "rad", float(observed[i]), freedom=freedom)]
        rows = rows + [row_of(s, *value, float(c[i])) for s, (value, c) in of_table.items()]
        unit = "rad/s" if name.symbol.startswith("b_") else "1"
        found.append(budget_of(name, unit, [r for r in rows if r.value > 0.0]))
    return tuple(found)
