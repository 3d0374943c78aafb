"""Flaw of the reference that the residuals of a calibration look like, and the smallest one that they would show.

Of the residual combinations y, free of coefficients and of covariance S, a flaw of size δ is ``y = δ·f + noise`` with f
its effect on them. ``δ̂ = fᵀS⁻¹y/fᵀS⁻¹f``, and it explains ``t = (fᵀS⁻¹y)²/fᵀS⁻¹f`` of chi-square.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtri, chndtr

from procedures.analysis.calibration.table_errors import TableErrors
from procedures.analysis.least_squares.chi_square import tail_probability
from procedures.analysis.least_squares.whitening import whitener
from procedures.core import units
from procedures.core.arrays import Array

LOOKS_SOUND = 0.01
"""P-value from which on what a flaw leaves of the residuals is taken for noise."""
SINGLE = ("orthogonality", "level", "azimuth", "gravity")
"""Flaws that are one number for all stations."""
NAMES = {
    "orthogonality": "a wrong right angle of the table",
    "level": "a wrong level",
    "azimuth": "a wrong azimuth",
    "gravity": "a wrong gravity",
    "direction": "a wrong direction",
}


@dataclass(frozen=True)
class FreeResiduals:
    """Residuals without what coefficients can explain, and the effect of each flaw of the table on them."""

    values: Array
    """Combinations y, shape (k,)."""
    covariance: Array
    """Their covariance by noise and declared flaws, shape (k, k)."""
    per_radian: Array
    """Change of y for a flaw of one radian (of one, for gravity), shape (k, P)."""
    source: tuple[str, ...]


def free_residuals(free: Array, covariance: Array, basis: Array, matrix: Array, table: TableErrors) -> FreeResiduals:
    """The residuals `free` (k,) of a fit in an orthonormal `basis` (n, k/3) of what its design leaves open."""
    of_outputs = np.einsum("cj,njp->ncp", matrix, table.sensitivity)
    effect = np.einsum("nk,ncp->ckp", basis, of_outputs)
    return FreeResiduals(free, covariance, effect.reshape(len(free), -1), table.source)


def suspect(found: FreeResiduals, labels: Sequence[str]) -> str:
    """The flaw that the residuals look like, as a sentence: one for all stations, one station, or a loose mounting.

    Empty where the residuals are as declared, or there is no table whose flaws could be found.
    """
    weights = whitener(found.covariance)
    y, f = weights @ found.values, weights @ found.per_radian
    square, freedom = float(y @ y), len(y)
    if freedom == 0 or tail_probability(square, freedom) >= LOOKS_SOUND:
        return ""
    singles = [j for j, one in enumerate(found.source) if one in SINGLE and float(f[:, j] @ f[:, j]) > 0.0]
    stations = _stations(y, f, found.source, len(labels))
    left: dict[str, float] = {}
    if singles and freedom > 1:
        explained = {j: float(f[:, j] @ y) ** 2 / float(f[:, j] @ f[:, j]) for j in singles}
        best = max(explained, key=lambda j: explained[j])
        said = _single(found.source[best], float(f[:, best] @ y) / float(f[:, best] @ f[:, best]), f[:, best])
        left[said] = tail_probability(square - explained[best], freedom - 1)
    if stations is not None and freedom > 3:
        worst = int(np.argmax(stations))
        said = f"the residuals look like one station that stood otherwise than commanded: {labels[worst]}"
        left[said] = tail_probability(square - float(stations[worst]), freedom - 3)
    if left and left[likeliest := max(left, key=lambda one: left[one])] >= LOOKS_SOUND:
        return likeliest
    if stations is None:
        return ""
    return (
        "no single flaw of the table explains the residuals: attitudes that differ from station to station by more "
        "than declared, as of a loose mounting, do"
    )


def _single(source: str, size: float, column: Array) -> str:
    sd = 1.0 / float(np.linalg.norm(column))
    if source == "gravity":
        return f"the residuals look like {NAMES[source]}: {size / units.PPM:.3g} ± {sd / units.PPM:.2g} ppm"
    return f"the residuals look like {NAMES[source]}: {size / units.ARCSEC:.3g} ± {sd / units.ARCSEC:.2g} arcsec"


def _stations(y: Array, f: Array, source: Sequence[str], stations: int) -> Array | None:
    """Chi-square that an attitude of its own explains at each station, (stations,); None without such flaws."""
    columns = [j for j, s in enumerate(source) if s in ("pointing", "direction")]
    if len(columns) != 3 * stations:
        return None
    explained = np.zeros(stations)
    for i in range(stations):
        basis, size, _ = np.linalg.svd(f[:, columns[3 * i : 3 * i + 3]], full_matrices=False)
        used = basis[:, size > 1e-9 * max(float(size[0]), 1e-300)]
        explained[i] = float(np.sum((used.T @ y) ** 2))
    return explained


def smallest_size(effect: Array, covariance: Array, level: float, power: float) -> float:
    """Smallest flaw that the residuals' chi-square at a level refuses with a probability.

    `effect` f (k,) on the residual combinations for a flaw of one, `covariance` S (k, k): chi-square is noncentral with
    ``λ = δ²·fᵀS⁻¹f``. Infinite where the residuals do not show the flaw at all.
    """
    size = float(np.linalg.norm(whitener(covariance) @ effect))
    freedom = float(len(effect))
    if size <= 1e-12 * float(np.linalg.norm(effect) / np.sqrt(np.trace(covariance))) or size == 0.0:
        return float("inf")
    bound = float(chdtri(freedom, level))
    needed = brentq(lambda x: float(chndtr(bound, freedom, x)) - (1.0 - power), 1e-6, 1e4)
    return float(np.sqrt(needed)) / size
