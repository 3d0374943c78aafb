"""Search for the mistake behind outputs that no bias and scale factor fit at the declared positions.

Hypotheses: two positions are exchanged, a turn was made in the other sense, channels are reversed or exchanged. Each
is tried by a plain line through every channel; one is named only where it explains the outputs `BETTER` times as well
as what was declared, or where only it has scale factors above zero.
"""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from procedures.analysis.field.fit import FieldModel
from procedures.analysis.field.positions import field_vectors
from procedures.core.arrays import Array

BETTER = 5.0
GOOD = 1e-3
"""Largest rms residual, relative to the magnitude, of a good fit of positions set by hand."""
FAIR = 0.03
"""Residual, relative to the magnitude, beyond which a line describes nothing."""
POSITIONS_MAX = 60
"""Number of positions beyond which no pairs are tried: their number grows as the square."""


def suspected(outputs: Array, model: FieldModel) -> str:
    """Return a warning about the likeliest mistake; empty where none explains the outputs (n, 3)."""
    declared, upright = _line(outputs, model, model.positions_rad)
    tried = [(*_line(seen, model, positions), name) for positions, seen, name in _hypotheses(outputs, model)]
    sound = sorted((rms, name) for rms, positive, name in tried if positive)
    size = float(np.linalg.norm(model.vector_r))
    good = GOOD * size
    # A reversed channel leaves exactly the residuals of the negative scale factor that it is found by.
    enough = 1.01 * declared if not upright and declared <= FAIR * size else declared / BETTER
    if not sound or sound[0][0] > enough or (upright and declared <= good):
        return ""
    least = [name for rms, name in sound if rms <= max(2.0 * sound[0][0], good)]
    return f"{' or '.join(least[:3])}: with that the outputs fit"


def _hypotheses(outputs: Array, model: FieldModel) -> Iterator[tuple[Array, Array, str]]:
    """Positions (n, 2), outputs (n, 3) and the mistake that they would be without."""
    positions = model.positions_rad
    if len(positions) <= POSITIONS_MAX:
        for i, j in combinations(range(len(positions)), 2):
            changed = positions.copy()
            changed[[i, j]] = positions[[j, i]]
            yield changed, outputs, f"positions {i + 1} and {j + 1} seem exchanged"
    for turn, name in enumerate("αβ"):
        if np.any(positions[:, turn] != 0.0):
            other = positions * np.where(np.arange(2) == turn, -1.0, 1.0)
            yield other, outputs, f"{name} seems turned in the other sense"
    for channel, name in enumerate("xyz"):
        yield positions, outputs * np.where(np.arange(3) == channel, -1.0, 1.0), f"channel {name} seems reversed"
    yield positions, -outputs, "all three channels seem reversed"
    for i, j in combinations(range(3), 2):
        order = [j if k == i else i if k == j else k for k in range(3)]
        yield positions, outputs[:, order], f"channels {'xyz'[i]} and {'xyz'[j]} seem exchanged"


def _line(outputs: Array, model: FieldModel, positions: Array) -> tuple[float, bool]:
    """Root mean square residual of a line through each channel, and True if no slope is negative.

    A channel whose input hardly changes has no slope of its own; one counts as negative beyond the noise alone.
    """
    vectors = field_vectors(positions, model.vector_r, model.tilt, np.array(model.tilt_rad))
    total, positive = 0.0, True
    for c in range(3):
        design = np.column_stack([np.ones(len(vectors)), vectors[:, c]])
        if model.estimate_scale:
            found = np.linalg.lstsq(design, outputs[:, c], rcond=None)[0]
            positive = positive and (float(found[1]) > 0.0 or float(np.ptp(vectors[:, c])) < 1e-6)
        else:
            found = np.array([np.mean(outputs[:, c] - vectors[:, c]), 1.0])
        total += float(np.sum((outputs[:, c] - design @ found) ** 2))
    return float(np.sqrt(total / outputs.size)), positive
