"""Result of `initial_alignment`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class Alignment(Part):
    """One alignment: observed (heading, pitch, roll), their errors against the table's, and the expected errors."""

    label: str
    """Name for people"""
    launch: int
    """Number of its launch within the recordings, from 1."""
    duration_s: float
    """Duration [s]"""
    attitude_deg: tuple[float, ...]
    """Attitude found: heading, pitch, roll [deg]"""
    error_deg: tuple[float, ...]
    """Error of heading, pitch and roll against the table's angles [deg]"""
    expected_sd_deg: tuple[float, ...]
    """Expected standard deviations; without the noise where that is not known [deg]"""


class AngleErrors(Part):
    """Errors of one angle over all alignments: observed, and predicted by the unit's record and calibration."""

    angle: str
    """Angle: heading, pitch or roll"""
    mean_error_deg: float
    """Mean error over the alignments [deg]"""
    mean_error_expected_sd_deg: float
    """Expected standard deviation of the mean error [deg]"""
    spread_deg: float | None
    """Sample standard deviation over the alignments; None for a single one [deg]"""
    expected_spread_deg: float | None
    """Expected spread between alignments [deg]"""
    expected_sd_deg: float
    """Expected standard deviation of a single alignment (root mean square over all) [deg]"""
    expected_by_source_deg: dict[str, float]
    """Expected standard deviation by source [deg]"""
    chi_square: float | None
    """``eᵀC⁻¹e`` over all alignments; None where the noise is not known."""
    p_value: float | None
    """Probability of a chi-square at least as large."""


class ThesisPrediction(Part):
    """Azimuth error of one alignment by thesis 1.1: in-run noise alone, no calibration, launch or table in it."""

    added_deg: float
    """Sum of the parts' magnitudes, as printed [deg]"""
    independent_deg: float
    """Root of the sum of their squares [deg]"""


class InitialAlignmentDocument(Part):
    """Result of every alignment, and each angle's errors with their prediction."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    basis: str
    """Basis of the uncertainties, as a sentence"""
    alignments: tuple[Alignment, ...]
    """Alignments in order"""
    angles: tuple[AngleErrors, ...]
    """Errors of heading, pitch and roll."""
    thesis: ThesisPrediction | None
    """Azimuth error by thesis 1.1, for comparison"""


class InitialAlignmentResult(ResultHead):
    """A result: Initial alignment, repeated."""

    kind: Literal["procedure"]
    name: Literal["initial_alignment"]
    document: InitialAlignmentDocument
