"""Result of `verification_9_orientations`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Magnitudes, Statement, Verdict


class Change(Part):
    """Change of one coefficient, or of a group that the stations cannot tell apart, after all others are fitted."""

    coefficients: tuple[str, ...]
    unit: str
    change: float | None
    standard_uncertainty: float | None
    sigmas: float
    smallest_named: float | None
    p_value_alone: float


class Movement(Part):
    """Explanation outside the triad: a turn between unit and table, or of the table's zero."""

    what: str
    arcsec: tuple[float, ...]
    p_value: float


class TriadDiagnosis(Part):
    """Scored changes of a triad, the largest first, and what the residuals say as a whole; JSON-ready."""

    triad: str
    changes: tuple[Change, ...]
    movements: tuple[Movement, ...]
    threshold_sigmas: float
    p_value_unchanged: float
    p_value_refitted: float | None
    sentence: str


class TriadVerification(Part):
    """Verification result of one triad, JSON-ready."""

    magnitudes: Magnitudes
    chi_square: float | None
    p_value: float | None
    run_to_run_known: bool
    diagnosis: TriadDiagnosis | None = None
    not_diagnosed: str = ""


class Verification9OrientationsDocument(Part):
    """Magnitudes of both triads before and after correction, and their agreement with the prediction."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    triads: tuple[TriadVerification, ...]


class Verification9OrientationsResult(ResultHead):
    """A result: Verification in nine orientations."""

    kind: Literal["procedure"]
    name: Literal["verification_9_orientations"]
    document: Verification9OrientationsDocument
