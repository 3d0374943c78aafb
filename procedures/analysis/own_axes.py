"""Axes that a triad's channels answer to: exchanged, reversed and dead channels are named by one rule everywhere.

A good unit's channels answer to their own axes with about one and to the others with hundredths. Each channel is judged
by its own largest answer, so scale factors do not count.
"""

from collections.abc import Sequence

import numpy as np

from procedures.core.arrays import Array
from procedures.core.limits import Check, Limit, check
from procedures.core.recording import AXES, TRIADS

DEAD = 0.2
"""Answer, as a share of the nominal one or of the triad's largest, that counts as none."""
CLEAR = 0.5
"""Share of a channel's largest answer that its other answers must stay beneath for one axis to be named."""
OWN_AXIS_MIN = 0.8
"""Least cosine between a channel's sensitive axis and the axis of its name. A channel that answers most to another
axis, or against its own, has at most 1/√2; one that answers clearly to its own has at least 1/√(1 + 2·`CLEAR`²)."""
OWN_AXES = " channels on their own axes"
"""Name of the check, after the triad's."""


def axes_answered(matrix: Array) -> tuple[str, ...]:
    """Return the axis to which each channel answers, by the rows of answers (3, 3): "+x", "−y", "nothing" or "no single
    axis".
    """
    return tuple(_axis(row) for row in matrix)


def _axis(row: Array) -> str:
    k = int(np.argmax(np.abs(row)))
    own, others = float(row[k]), np.abs(np.delete(row, k))
    if abs(own) < DEAD:
        return "nothing"
    return f"{'+' if own > 0.0 else '−'}{AXES[k]}" if others.max() <= CLEAR * abs(own) else "no single axis"


def wrong_axes(triad: str, axes: Sequence[str]) -> str:
    """Return a sentence naming exchanged, reversed and dead channels by the axes that they answer to; empty for a good
    triad.
    """
    names, own = TRIADS[triad], [f"+{axis}" for axis in AXES]
    told: list[str] = []
    for i, (name, axis) in enumerate(zip(names, axes, strict=True)):
        partner = next((j for j in range(3) if j != i and axis[1:] == AXES[j]), None)
        if partner is not None and axes[partner][1:] == AXES[i]:
            if partner > i:
                signs = "" if axis[0] == axes[partner][0] == "+" else f" ({axis} and {axes[partner]})"
                told.append(f"{name} and {names[partner]} are exchanged{signs}")
        elif axis == f"−{AXES[i]}":
            told.append(f"{name} is reversed")
        elif axis != own[i]:
            told.append(f"{name} answers to {axis}")
    return "; ".join(told)


def own_axis_check(triad: str, matrix: Array) -> Check:
    """Return the check of the least cosine between a channel's sensitive axis, a row of K (3, 3), and the axis of its
    name.

    A linear fit makes a good calibration of exchanged channels too, and its residuals do not show them.
    """
    lengths = np.linalg.norm(matrix, axis=1)
    cosines = np.diagonal(matrix) / np.where(lengths > 0.0, lengths, 1.0)
    worst = int(np.argmin(cosines))
    own = np.array([row / max(float(np.abs(row).max()), np.finfo(float).tiny) for row in matrix])
    note = wrong_axes(triad, axes_answered(own)) or f"least: {TRIADS[triad][worst]}"
    return check(
        f"{triad}{OWN_AXES}", float(cosines[worst]), Limit("1", minimum=OWN_AXIS_MIN, source="ours"), note=note
    )
