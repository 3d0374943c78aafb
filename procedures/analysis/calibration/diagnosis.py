"""Diagnosis of a verification: which coefficient of a triad moved since its calibration, and by how many sigma.

The residual vectors of the stations, ``r = U − b̂ − K̂·v``, are ``r = A·δ + e`` with δ the change of the twelve
coefficients. The covariance of e holds the noise of the dwells, the calibration's own covariance, the change between
two launches by the unit's record, and the declared flaws of the table: ``S = C + A·P·Aᵀ + L + F·Fᵀ``. All twelve are
fitted at once by generalised least squares, so each change is scored *after all others are fitted*: ``z = δ̂/σ(δ̂)`` is
normal with unit variance where that coefficient did not move, however far another one did. Coefficients that the
stations cannot tell apart (the null space of the design) are scored as one group by the chi-square that the group takes
off after all others. The scalar diagnostics of a magnitude (thesis [34, 35, 81]) see only what changes |v|.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, ndtri, ndtri_exp

from procedures.analysis.calibration.table_errors import TableErrors
from procedures.analysis.least_squares.chi_square import tail_probability
from procedures.analysis.least_squares.whitening import whitener
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration, coefficient_unit
from procedures.importing import IMPORTING

FALSE_ALARM = 0.01
"""Chance that a triad of which nothing moved has a coefficient named, over all its candidates together."""
LIKELY_P_VALUE = 0.001
"""Chi-square of residuals less likely than this is not explained."""
SHARE_NAMED = 0.9
"""Power for which the smallest change that is named is given."""
_NULL_TOLERANCE = 1e-6
"""Singular values of the column-scaled design beneath this part of the largest count as zero."""


@dataclass(frozen=True)
class Change:
    """Change of one coefficient, or of a group that the stations cannot tell apart, after all others are fitted."""

    coefficients: tuple[str, ...]
    """"b_x", "K11", …; several: a group."""
    unit: str
    """Unit of `change`; of a group "σ"."""
    change: float | None
    """Unit's value now less the calibration's [SI]; None for a group."""
    standard_uncertainty: float | None
    sigmas: float
    """``change/standard_uncertainty``; of a group the normal deviation as likely as its chi-square, zero if unseen."""
    smallest_named: float | None
    """Change that is named with 90 % [unit of `change`]; None for a group."""
    p_value_alone: float
    """Chance of residuals as large as those left where this alone moved."""

    @property
    def name(self) -> str:
        """Names of the coefficients as a sentence lists them."""
        return " or ".join(self.coefficients)


@dataclass(frozen=True)
class Movement:
    """Explanation outside the triad: a turn between unit and table, or of the table's zero."""

    what: str
    arcsec: tuple[float, ...]
    """Angles found; their axes are in `what`."""
    p_value: float
    """Chance of residuals as large as those left after it."""


@dataclass(frozen=True)
class TriadDiagnosis:
    """Scored changes of a triad, the largest first, and what the residuals say as a whole: their p-values, and
    movements outside the triad that would explain them.
    """

    triad: str
    changes: tuple[Change, ...]
    movements: tuple[Movement, ...]
    threshold_sigmas: float
    p_value_unchanged: float
    """Chance of residuals as large where nothing moved."""
    p_value_refitted: float | None
    """Chance of residuals as large as those left after all twelve are fitted; None where no equation is spare."""
    sentence: str

    @property
    def named(self) -> tuple[Change, ...]:
        """Changes beyond the threshold, the largest first."""
        return tuple(c for c in self.changes if abs(c.sigmas) >= self.threshold_sigmas)


def residual_covariance(
    calibration: TriadCalibration, vectors: Array, noise: Array, launch: Array | None, table: TableErrors
) -> Array:
    """Covariance S (3n, 3n) of the residuals of an unchanged unit, stacked channel by channel.

    `noise` and `launch` (both launches' together) are by channel, (3, n, n); vectors (n, 3).
    """
    n = len(vectors)
    design = coefficient_columns(vectors)
    flaws = table.of_outputs(calibration.matrix_array).transpose(1, 0, 2).reshape(3 * n, -1)
    covariance = design @ calibration.covariance_array @ design.T + flaws @ flaws.T
    by_channel = noise if launch is None else noise + launch
    for c in range(3):
        covariance[c * n : c * n + n, c * n : c * n + n] += by_channel[c]
    return covariance


def coefficient_columns(vectors: Array) -> Array:
    """Return the outputs per change of the twelve coefficients, stacked channel by channel: A, shape (3n, 12)."""
    one = np.column_stack([np.ones(len(vectors)), vectors])
    return np.asarray(np.kron(np.eye(3), one), dtype=np.float64)


def diagnose(
    calibration: TriadCalibration, outputs: Array, vectors: Array, covariance: Array, table: TableErrors
) -> TriadDiagnosis:
    """Return the scores of every change that the residuals of n ≥ 2 stations could show; outputs and vectors (n, 3).

    `covariance` as `residual_covariance` gives it; `table` says how a turn of its zero would look.
    """
    residuals = (outputs - calibration.bias_array - vectors @ calibration.matrix_array.T).T.ravel()
    weights = whitener(covariance)
    design, seen = weights @ coefficient_columns(vectors), weights @ residuals
    groups = inseparable(vectors)
    threshold = float(-ndtri(FALSE_ALARM / len(groups) / 2.0))
    changes = [_change(calibration, g, design, seen, threshold) for g in groups]
    ordered = tuple(sorted(changes, key=lambda c: -abs(c.sigmas)))
    movements = _movements(calibration, vectors, table, weights, seen)
    unchanged = tail_probability(float(seen @ seen), len(seen))
    refitted = _p_value_after(design, seen)
    sentence = _sentence(calibration, ordered, movements, threshold, unchanged, refitted)
    return TriadDiagnosis(calibration.triad, ordered, movements, threshold, unchanged, refitted, sentence)


def inseparable(vectors: Array) -> tuple[tuple[int, ...], ...]:
    """Groups of the twelve coefficients that residuals at input vectors (n, 3) cannot tell apart; alone: (k,).

    The projector on the null space of the column-scaled design ties the coefficients of a channel: it has blocks, one a
    group. It does not depend on the weights, since their matrix is regular.
    """
    design = np.column_stack([np.ones(len(vectors)), vectors])
    lengths = np.linalg.norm(design, axis=0)
    zero = lengths <= _NULL_TOLERANCE * lengths.max()
    scaled = np.where(zero, 0.0, design / np.where(zero, 1.0, lengths))
    _, values, basis = np.linalg.svd(np.vstack([scaled, np.zeros((4, 4))]), full_matrices=False)
    lost = basis[values <= _NULL_TOLERANCE * values[0]]
    tied = np.abs(lost.T @ lost) > _NULL_TOLERANCE
    groups: list[tuple[int, ...]] = []
    for k in range(4):
        if not any(k in g for g in groups):
            groups.append(_reached(k, tied))
    return tuple(tuple(4 * channel + k for k in group) for channel in range(3) for group in groups)


def _reached(start: int, tied: NDArray[np.bool_]) -> tuple[int, ...]:
    """Columns tied to `start`, by way of others too."""
    found, waiting = {start}, [start]
    while waiting:
        for k in np.flatnonzero(tied[waiting.pop()]).tolist():
            if k not in found:
                found.add(k)
                waiting.append(k)
    return tuple(sorted(found))


def _change(
    calibration: TriadCalibration, group: Sequence[int], design: Array, seen: Array, threshold: float
) -> Change:
    """Score one coefficient or group: what it takes off the residuals after all others are fitted."""
    columns, names = list(group), tuple(COEFFICIENT_NAMES[k] for k in group)
    own = design[:, columns]
    rest = _off(np.delete(design, columns, axis=1), own)
    basis = _basis(rest, np.linalg.norm(own, axis=0))
    taken = basis.T @ seen
    alone = _p_value_after(own, seen)
    p_alone = 1.0 if alone is None else alone
    if len(group) > 1 or basis.shape[1] == 0:
        return Change(names, "σ", None, None, _as_sigmas(float(taken @ taken), basis.shape[1]), None, p_alone)
    column = rest[:, 0]
    sd = 1.0 / float(np.linalg.norm(column))
    change = float(column @ seen) * sd**2
    unit = coefficient_unit(names[0], calibration.output_unit, calibration.input_unit)
    smallest = (threshold + float(ndtri(SHARE_NAMED))) * sd
    return Change(names, unit, change, sd, change / sd, smallest, p_alone)


def _as_sigmas(statistic: float, degrees: int) -> float:
    """Normal deviation as likely, two-sided, as a chi-square so large; not past what doubles can tell apart."""
    with IMPORTING:
        from scipy.stats import chi2  # with all of scipy's statistics: only where it is called

    if degrees == 0:
        return 0.0
    if degrees == 1:
        return float(np.sqrt(statistic))
    logarithm = float(chi2.logsf(statistic, degrees))
    if not np.isfinite(logarithm):
        logarithm = float(log_ndtr(-np.sqrt(statistic)))  # so far out that degrees of freedom hardly count
    return float(-ndtri_exp(logarithm - np.log(2.0)))


def _off(others: Array, columns: Array) -> Array:
    """Part of whitened columns (m, k) that no combination of the others gives."""
    basis = _basis(others, np.linalg.norm(others, axis=0))
    return columns - basis @ (basis.T @ columns)


def _basis(columns: Array, lengths: Array) -> Array:
    """Orthonormal basis of what columns (m, k) span, each weighed against its length; (m, rank)."""
    if columns.shape[1] == 0 or not np.any(lengths > 0.0):
        return np.zeros((len(columns), 0))
    left, values, _ = np.linalg.svd(columns / np.where(lengths > 0.0, lengths, 1.0), full_matrices=False)
    return np.asarray(left[:, values > 1e-9], dtype=np.float64)


def _p_value_after(columns: Array, seen: Array) -> float | None:
    """Chance of residuals as large as those left after whitened columns are fitted; None without a spare equation."""
    basis = _basis(columns, np.linalg.norm(columns, axis=0))
    left = seen - basis @ (basis.T @ seen)
    degrees = len(seen) - basis.shape[1]
    return tail_probability(float(left @ left), degrees) if degrees > 0 else None


def _movements(
    calibration: TriadCalibration, vectors: Array, table: TableErrors, weights: Array, seen: Array
) -> tuple[Movement, ...]:
    """Turns outside the triad that could look like a change of it: of the unit on its table, of the table's zero."""
    matrix = calibration.matrix_array
    mounted = np.stack([np.cross(vectors, axis) for axis in np.eye(3)], axis=2)
    kinds = [("turn of the unit on the table about its x, y, z", mounted)]
    azimuth = np.take(table.sensitivity, np.flatnonzero(table.columns("azimuth")), axis=2)
    if calibration.triad == "gyro" and azimuth.size:
        kinds.append(("turn of the table's zero about the vertical", azimuth))
    found: list[Movement] = []
    for what, sensitivity in kinds:
        columns = weights @ np.einsum("cj,njp->cnp", matrix, sensitivity).reshape(len(seen), -1)
        p_value = _p_value_after(columns, seen)
        angles = np.linalg.lstsq(columns, seen, rcond=None)[0] / units.ARCSEC
        if p_value is not None:
            found.append(Movement(what, tuple(angles.tolist()), p_value))
    return tuple(found)


def _sentence(
    calibration: TriadCalibration,
    changes: Sequence[Change],
    movements: Sequence[Movement],
    threshold: float,
    unchanged: float,
    refitted: float | None,
) -> str:
    """Sentence or two on the coefficients that moved."""
    triad = calibration.triad
    named = [c for c in changes if abs(c.sigmas) >= threshold]
    if not named and unchanged >= LIKELY_P_VALUE:
        return f"{triad}: no coefficient moved."
    outside = [m for m in movements if m.p_value >= LIKELY_P_VALUE]
    turned = "".join(f" A {m.what} would explain it alone: {_angles(m.arcsec)}." for m in outside)
    if refitted is not None and refitted < LIKELY_P_VALUE:
        said = (
            "the residuals fit no change of its coefficients: the table, the site, the mounting or the noise is wrong"
        )
        largest = f"; the largest change is {_named(changes[0])}" if named else ""
        return f"{triad}: {said}{largest}.{turned}"
    if named:
        return f"{triad}: {', '.join(map(_named, named))} moved.{turned if len(named) > 1 else ''}"
    alone = [c.name for c in changes if c.p_value_alone >= LIKELY_P_VALUE]
    one = f"each of these alone would explain it: {', '.join(alone)}" if alone else "no single change explains it"
    return f"{triad}: something moved, and these stations do not show which; {one}.{turned}"


def _named(change: Change) -> str:
    return f"{change.name} ({change.sigmas:+.1f} σ)"


def _angles(arcsec: Sequence[float]) -> str:
    return ", ".join(f"{a:+.3g}″" for a in arcsec)
