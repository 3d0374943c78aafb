"""Result of `verification_9_orientations`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, DwellsSaved, Magnitudes, Statement, Verdict


class Change(Part):
    """Change of one coefficient, or of a group that the stations cannot tell apart, after all others are fitted."""

    coefficients: tuple[str, ...]
    """"b_x", "K11", …; several: a group."""
    unit: str
    """Unit of `change`; of a group "σ"."""
    change: float | None
    """Unit's value now less the calibration's [SI]; None for a group."""
    standard_uncertainty: float | None
    """Standard uncertainty, in the unit of the value"""
    sigmas: float
    """``change/standard_uncertainty``; of a group the normal deviation as likely as its chi-square, zero if
    unseen.
    """
    smallest_named: float | None
    """Change that is named with 90 % [unit of `change`]; None for a group."""
    p_value_alone: float
    """Chance of residuals as large as those left where this alone moved."""


class Movement(Part):
    """Explanation outside the triad: a turn between unit and table, or of the table's zero."""

    what: str
    """What would have moved"""
    arcsec: tuple[float, ...]
    """Angles found; their axes are in `what`."""
    p_value: float
    """Chance of residuals as large as those left after it."""


class TriadDiagnosis(Part):
    """Scored changes of a triad, the largest first, and what the residuals say as a whole: their p-values, and
    movements outside the triad that would explain them.
    """

    triad: str
    """Triad: gyro or accelerometer"""
    changes: tuple[Change, ...]
    """Change of each coefficient since the calibration"""
    movements: tuple[Movement, ...]
    """Movements of the unit or the table that would explain the residuals alone"""
    threshold_sigmas: float
    """Change in standard deviations from which a coefficient is named"""
    p_value_unchanged: float
    """Chance of residuals as large where nothing moved."""
    p_value_refitted: float | None
    """Chance of residuals as large as those left after all twelve are fitted; None where no equation is spare."""
    sentence: str
    """The finding, as a sentence"""


class TriadVerification(Part):
    """Verification result of one triad: magnitudes, their test against the prediction, and the diagnosis."""

    magnitudes: Magnitudes
    """Errors of the magnitude at the stations"""
    chi_square: float | None
    """Chi-square of the errors after correction against their predicted covariance; None for unknown noise."""
    p_value: float | None
    """p-value: probability that noise alone gives a statistic at least this large"""
    run_to_run_known: bool
    """False where the unit's record has no change from launch to launch: then the prediction holds in one launch
    only.
    """
    diagnosis: TriadDiagnosis | None = None
    """Which coefficients moved since the calibration; null: not diagnosed"""
    not_diagnosed: str = ""
    """Reason why there is no diagnosis; empty where there is one."""


class Verification9OrientationsDocument(Part):
    """Magnitudes of both triads before and after correction, and their agreement with the prediction."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    triads: tuple[TriadVerification, ...]
    """Triads, one entry each"""
    dwells: DwellsSaved | None = None
    """dwells ended by the stop rule, and the time saved"""


class Verification9OrientationsResult(ResultHead):
    """A result: Verification in nine orientations."""

    kind: Literal["procedure"]
    name: Literal["verification_9_orientations"]
    document: Verification9OrientationsDocument
