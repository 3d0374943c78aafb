"""Result of `initial_alignment_of_recording`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class AlignedAttitude(Part):
    """Attitude from one recording [deg]; heading clockwise from north, 0 … 360."""

    recording: str
    heading_deg: float
    pitch_deg: float
    roll_deg: float
    heading_sd_deg: float
    pitch_sd_deg: float
    roll_sd_deg: float
    duration_s: float
    predicted_azimuth_error_deg: float | None
    predicted_azimuth_sd_deg: float | None
    magnitude_errors: tuple[float, ...]
    magnitude_sd: tuple[float, ...]
    step_deg: float | None = None
    step_at_s: float | None = None
    step_by: str = ""
    step_visible_deg: float | None = None


class InitialAlignmentOfRecordingDocument(Part):
    """Every recording's attitude, in order."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    basis: str
    attitudes: tuple[AlignedAttitude, ...]


class InitialAlignmentOfRecordingResult(ResultHead):
    """A result: Initial alignment from a recording at rest."""

    kind: Literal["method"]
    name: Literal["initial_alignment_of_recording"]
    document: InitialAlignmentOfRecordingDocument
