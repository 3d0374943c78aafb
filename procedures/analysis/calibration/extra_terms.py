"""Terms in addition to ``U = b + K·v`` that a set of positions may determine: K₂, asymmetry, a gyro's g-sensitivity.

``U_c = b_c + Σ_j K_cj·v_j + K2_c·v_c² + KA_c·|v_c| + Σ_j G_cj·f_j`` by generalised least squares over all outputs of
the triad at once (IEEE Std 1293 and 647 name the terms), weighted by the covariance of the means and of the table's
flaws. A term that the positions cannot tell from the others is refused in words that say which position is missing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import block_diag, null_space
from scipy.special import ndtr, stdtr

from procedures.analysis.calibration.noise_scale import noise_factor
from procedures.analysis.calibration.table_errors import TableErrors
from procedures.analysis.least_squares.chi_square import chi_square, judged_p_value
from procedures.analysis.least_squares.determination import RANK_TOLERANCE, require_full_rank
from procedures.analysis.least_squares.inverse import scaled_pinv
from procedures.analysis.least_squares.whitening import whitener
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, Undetermined
from procedures.core.imu_model import COEFFICIENT_NAMES
from procedures.core.recording import AXES

Kind = Literal["quadratic", "asymmetry", "g_sensitivity"]
SYMBOLS: dict[Kind, str] = {"quadratic": "K2", "asymmetry": "KA", "g_sensitivity": "G"}
MISSING: dict[Kind, str] = {
    "quadratic": "each axis must be seen at three different inputs at least, such as up, level and down",
    "asymmetry": "each axis must be seen at inputs of both signs and, beside K2, of two sizes, such as 45° and 90°",
    "g_sensitivity": "the specific force must change where the rate does not: turn the unit about the Earth's axis, or "
    "add positions with the same axis to the north and another one up",
}
CLAIMED = 0.01
"""Probability with which an absent term is reported present."""


@dataclass(frozen=True)
class Term:
    """One coefficient of a kind in one channel, and its regressor at the stations."""

    kind: Kind
    name: str
    """K2_x, KA_x; of the g-sensitivity G_xy: rate of gyro x per specific force along y."""
    channel: int
    regressor: Array
    """Shape (n,)."""


@dataclass(frozen=True)
class TermEstimate:
    """One further coefficient with its standard uncertainty, and the decision whether it is present."""

    kind: Kind
    name: str
    unit: str
    estimate: float
    standard_uncertainty: float
    p_value: float
    """Chance of an estimate at least as far from zero without the term."""
    present: bool


@dataclass(frozen=True)
class ExtraFit:
    """Twelve coefficients with further terms; `covariance` (12, 12) has what the terms take from them."""

    coefficients: Array
    """Shape (12,), in the order of `COEFFICIENT_NAMES`."""
    covariance: Array
    terms: tuple[TermEstimate, ...]
    condition: float
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    residuals: Array
    """Outputs minus model, (n, 3)."""


def terms_of(kinds: Sequence[Kind], vectors: Array, forces: Array | None) -> tuple[Term, ...]:
    """The regressors of the asked kinds; `vectors` (n, 3) are the triad's inputs, `forces` (n, 3) for g-sensitivity.

    Raises `BadParameter`.
    """
    found: list[Term] = []
    for kind in kinds:
        if kind == "g_sensitivity" and forces is None:
            raise BadParameter("terms", kind, "the gyros' only: an accelerometer's input is the specific force itself")
        for c, axis in enumerate(AXES):
            if kind == "quadratic":
                found.append(Term(kind, f"K2_{axis}", c, vectors[:, c] ** 2))
            elif kind == "asymmetry":
                found.append(Term(kind, f"KA_{axis}", c, np.abs(vectors[:, c])))
            elif forces is not None:
                found += [Term(kind, f"G_{axis}{of}", c, forces[:, j]) for j, of in enumerate(AXES)]
    return tuple(found)


def require_terms(what: str, vectors: Array, terms: Sequence[Term], tolerance: float = RANK_TOLERANCE) -> float:
    """Return the condition number of the channel that is determined worst. Raises `Undetermined` saying which position
    to add.
    """
    worst = 1.0
    for c, axis in enumerate(AXES):
        own = [t for t in terms if t.channel == c]
        design = np.column_stack([np.ones(len(vectors)), vectors, *(t.regressor for t in own)])
        names = [f"b_{axis}", *(f"K{c + 1}{j}" for j in (1, 2, 3)), *(t.name for t in own)]
        try:
            worst = max(worst, require_full_rank(what, design, names, tolerance))
        except Undetermined as refusal:
            advice = [
                MISSING[kind]
                for kind in SYMBOLS
                if any(t.name in " ".join(refusal.lost) for t in own if t.kind == kind)
            ]
            lost = (*refusal.lost, *(f"to determine it, {text}" for text in advice))
            raise Undetermined(
                f"{what} of axis {axis}", lost, refusal.rank, refusal.wanted, refusal.condition
            ) from refusal
    return worst


def fit_terms(
    what: str,
    vectors: Array,
    outputs: Array,
    noise_covariance: Array,
    table: TableErrors,
    terms: Sequence[Term],
    units: tuple[str, str],
    noise_known: bool = True,
) -> ExtraFit:
    """Least squares of the twelve coefficients and the terms: outputs and `vectors` (n, 3), noise (3, n, n).

    `units`: of output and input. Where the noise is not known its covariance is scaled up to what the residuals show,
    never down, and a term is judged by Student's t. Raises `Undetermined`.
    """
    n = len(outputs)
    condition = require_terms(what, vectors, terms)
    design = np.zeros((3 * n, 12 + len(terms)))
    for c in range(3):
        design[c * n : (c + 1) * n, 4 * c : 4 * c + 4] = np.column_stack([np.ones(n), vectors])
    for k, term in enumerate(terms):
        design[term.channel * n : (term.channel + 1) * n, 12 + k] = term.regressor
    y, noise = outputs.T.ravel(), block_diag(*noise_covariance)
    first = scaled_pinv(design) @ y
    flaws = table.of_outputs(first[:12].reshape(3, 4)[:, 1:]).transpose(1, 0, 2).reshape(3 * n, -1)
    basis = null_space((design / np.linalg.norm(design, axis=0)).T)
    free, of_noise = basis.T @ y, basis.T @ noise @ basis
    of_flaws = (basis.T @ flaws) @ (basis.T @ flaws).T
    factor = 1.0 if noise_known else noise_factor(free, of_noise, of_flaws)
    weights = whitener(noise * factor + flaws @ flaws.T)
    inverse = scaled_pinv(weights @ design)
    found, covariance = inverse @ (weights @ y), inverse @ inverse.T
    statistic = chi_square(free, of_noise * factor + of_flaws)
    return ExtraFit(
        found[:12],
        covariance[:12, :12],
        _estimates(terms, found[12:], np.sqrt(np.diagonal(covariance))[12:], units, None if noise_known else len(free)),
        condition,
        statistic,
        len(free),
        judged_p_value(statistic, len(free), noise_known),
        (y - design @ found).reshape(3, n).T,
    )


def _estimates(
    terms: Sequence[Term], values: Array, sds: Array, units: tuple[str, str], degrees: int | None
) -> tuple[TermEstimate, ...]:
    output, given = units
    of_kind: dict[Kind, str] = {
        "quadratic": f"{output}/({given})^2",
        "asymmetry": "1" if output == given else f"{output}/({given})",
        "g_sensitivity": f"{output}/(m/s^2)",
    }
    found: list[TermEstimate] = []
    for term, value, sd in zip(terms, values.tolist(), sds.tolist(), strict=True):
        ratio = abs(value) / sd
        p = float(2.0 * (ndtr(-ratio) if degrees is None else stdtr(max(degrees, 1), -ratio)))
        found.append(TermEstimate(term.kind, term.name, of_kind[term.kind], value, sd, p, p < CLAIMED))
    return tuple(found)


def named(fit: ExtraFit) -> dict[str, float]:
    """Return all coefficients by name: the twelve, then the terms."""
    return dict(zip(COEFFICIENT_NAMES, fit.coefficients.tolist(), strict=True)) | {
        t.name: t.estimate for t in fit.terms
    }
