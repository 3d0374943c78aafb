"""Result of `initial_alignment`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class Alignment(Part):
    """One alignment: observed (heading, pitch, roll), their errors against the table's, and the expected errors."""

    label: str
    launch: int
    duration_s: float
    attitude_deg: tuple[float, ...]
    error_deg: tuple[float, ...]
    expected_sd_deg: tuple[float, ...]


class AngleErrors(Part):
    """Errors of one angle over all alignments: observed, and predicted by the unit's record and calibration."""

    angle: str
    mean_error_deg: float
    mean_error_expected_sd_deg: float
    spread_deg: float | None
    expected_spread_deg: float | None
    expected_sd_deg: float
    expected_by_source_deg: dict[str, float]
    chi_square: float | None
    p_value: float | None


class ThesisPrediction(Part):
    """Azimuth error of one alignment by thesis 1.1: in-run noise alone, no calibration, launch or table in it."""

    added_deg: float
    independent_deg: float


class InitialAlignmentDocument(Part):
    """Result of every alignment, and each angle's errors with their prediction."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    basis: str
    alignments: tuple[Alignment, ...]
    angles: tuple[AngleErrors, ...]
    thesis: ThesisPrediction | None


class InitialAlignmentResult(ResultHead):
    """A result: Initial alignment, repeated."""

    kind: Literal["procedure"]
    name: Literal["initial_alignment"]
    document: InitialAlignmentDocument
