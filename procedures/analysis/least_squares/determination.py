"""Test whether a set of orientations determines the unknowns, before any solve; the error names the lost
combinations.
"""

from collections.abc import Sequence

import numpy as np

from procedures.core.arrays import Array
from procedures.core.errors import Undetermined

RANK_TOLERANCE = 1e-9
"""Singular values beneath this part of the largest count as zero (columns scaled to unit length)."""


def require_full_rank(what: str, design: Array, names: Sequence[str], tolerance: float = RANK_TOLERANCE) -> float:
    """Condition number of the column-scaled `design` (n, k), or `Undetermined` with the lost combinations in words.

    Each column stands for the unknown of the same place in `names`. Scaling to unit columns takes the choice of units
    out of rank and condition alike.
    """
    rows, wanted = design.shape
    lengths = np.linalg.norm(design, axis=0)
    largest = float(lengths.max(initial=0.0))
    lengths = np.where(lengths > tolerance * largest, lengths, np.inf)
    padded = np.vstack([design / lengths, np.zeros((max(0, wanted - rows), wanted))])
    _, values, basis = np.linalg.svd(padded, full_matrices=False)
    condition = float(values[0] / max(values[-1], np.finfo(np.float64).eps * values[0], np.finfo(np.float64).tiny))
    rank = int(np.sum(values > tolerance * values[0]))
    if rank < wanted:
        scale = np.where(np.isfinite(lengths), lengths, 1.0)
        raise Undetermined(what, _in_words(basis[rank:] / scale * scale.max(), names), rank, wanted, condition)
    return condition


def _in_words(null_space: Array, names: Sequence[str]) -> list[str]:
    """Name each row of a reduced basis of the null space as a sum of unknowns."""
    return [_combination(row, names) for row in _reduced(null_space)]


def _reduced(basis: Array) -> Array:
    """Row echelon form with the largest pivots, so that each combination has as few names as can be."""
    rows = basis.copy()
    for k in range(len(rows)):
        i, j = divmod(int(np.argmax(np.abs(rows[k:]))), rows.shape[1])
        rows[[k, k + i]] = rows[[k + i, k]]
        rows[k] /= rows[k, j]
        others = np.arange(len(rows)) != k
        rows[others] -= np.outer(rows[others, j], rows[k])
    return rows


def _combination(row: Array, names: Sequence[str]) -> str:
    terms = [(float(w), name) for w, name in zip(row / np.abs(row).max(), names, strict=True) if abs(w) > 1e-6]
    terms.sort(key=lambda term: -abs(term[0]))
    if len(terms) == 1:
        return terms[0][1]
    sign = np.sign(terms[0][0])
    return " ".join(
        f"{'+' if w * sign > 0 else '−'} {'' if abs(abs(w) - 1) < 1e-6 else f'{abs(w):.3g}·'}{name}"
        for w, name in terms
    ).removeprefix("+ ")
