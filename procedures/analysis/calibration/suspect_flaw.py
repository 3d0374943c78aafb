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
NEARLY = float(chdtri(1, 0.01))
"""A flaw that explains less of chi-square than the best by no more than this is named too: where it is the true one,
another explains so much more with a chance of at most 1 %."""
DISAGREE = 3.0
"""Sizes of one flaw from two triads that differ by more standard uncertainties contradict each other."""
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
    """Return the residuals `free` (k,) of a fit in an orthonormal `basis` (n, k/3) of what its design leaves open, with
    the effects of flaws.
    """
    of_outputs = np.einsum("cj,njp->ncp", matrix, table.sensitivity)
    effect = np.einsum("nk,ncp->ckp", basis, of_outputs)
    return FreeResiduals(free, covariance, effect.reshape(len(free), -1), table.source)


def suspect(found: FreeResiduals, labels: Sequence[str], others: Sequence[FreeResiduals] = ()) -> str:
    """The flaw that the residuals look like, as a sentence: one for all stations, one station, or a loose mounting.

    Flaws for all stations that explain nearly as much as the best one are all named, except those that the residuals of
    the other triads at the same stations, `others`, contradict: gyros cannot tell a wrong azimuth from a wrong level,
    accelerometers see the level. Empty where the residuals are as declared, or there is no table whose flaws could be
    told.
    """
    weights = whitener(found.covariance)
    y, f = weights @ found.values, weights @ found.per_radian
    square, freedom = float(y @ y), len(y)
    if freedom == 0 or tail_probability(square, freedom) >= LOOKS_SOUND:
        return ""
    singles = _singles(found, y, f, others) if freedom > 1 else []
    stations = _stations(y, f, found.source, len(labels))
    left: dict[str, float] = {}
    if singles:
        said = " or ".join(_single(found.source[one.column], one) for one in singles)
        unclear = "; these residuals cannot tell which" if len(singles) > 1 else ""
        best = max(one.explained for one in singles)
        left[f"the residuals look like {said}{unclear}"] = tail_probability(square - best, freedom - 1)
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


@dataclass(frozen=True)
class _Flaw:
    """Estimate of one flaw alone: its column, size, standard uncertainty, and the chi-square that it explains."""

    column: int
    size: float
    sd: float
    explained: float


def _estimated(y: Array, f: Array, column: int) -> _Flaw | None:
    """Estimate one flaw from whitened residuals; None where they do not show it."""
    information, projected = float(f[:, column] @ f[:, column]), float(f[:, column] @ y)
    if information <= 1e-18 * float(np.sum(f**2)):
        return None
    return _Flaw(column, projected / information, information**-0.5, projected**2 / information)


def _singles(found: FreeResiduals, y: Array, f: Array, others: Sequence[FreeResiduals]) -> list[_Flaw]:
    """Flaws for all stations that explain nearly as much as the best, the best of each source, largest share first."""
    every = [_estimated(y, f, j) for j, source in enumerate(found.source) if source in SINGLE]
    possible = [one for one in every if one is not None and not any(_contradicts(o, one) for o in others)]
    possible.sort(key=lambda one: -one.explained)
    best: dict[str, _Flaw] = {}
    for one in possible:
        if one.explained >= possible[0].explained - NEARLY:
            best.setdefault(found.source[one.column], one)
    return list(best.values())


def _contradicts(other: FreeResiduals, flaw: _Flaw) -> bool:
    """Whether another triad's residuals, which show the flaw, give it another size.

    Its standard uncertainty is scaled up to its residuals, which may show some other flaw.
    """
    weights = whitener(other.covariance)
    y = weights @ other.values
    seen = _estimated(y, weights @ other.per_radian, flaw.column)
    if seen is None:
        return False
    scale = max(1.0, float(y @ y) / max(len(y), 1))
    return abs(seen.size - flaw.size) > DISAGREE * float(np.sqrt(scale * seen.sd**2 + flaw.sd**2))


def _single(source: str, flaw: _Flaw) -> str:
    unit, name = (units.PPM, "ppm") if source == "gravity" else (units.ARCSEC, "arcsec")
    return f"{NAMES[source]}: {flaw.size / unit:.3g} ± {flaw.sd / unit:.2g} {name}"


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
