"""Result of `initial_alignment_of_recording`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class AlignedAttitude(Part):
    """Attitude from one recording [deg]; heading clockwise from north, 0 … 360."""

    recording: str
    """Recording, by its id"""
    heading_deg: float
    """Heading, from north [deg]"""
    pitch_deg: float
    """Pitch [deg]"""
    roll_deg: float
    """Roll [deg]"""
    heading_sd_deg: float
    """Standard uncertainty of the heading [deg]"""
    pitch_sd_deg: float
    """Standard uncertainty of the pitch [deg]"""
    roll_sd_deg: float
    """Standard uncertainty of the roll [deg]"""
    duration_s: float
    """Duration [s]"""
    predicted_azimuth_error_deg: float | None
    """Predicted azimuth error, its parts added by magnitude (thesis 1.1); None where the unit's noise is not known
    [deg]
    """
    predicted_azimuth_sd_deg: float | None
    """Predicted azimuth error with the parts as independent standard uncertainties [deg]"""
    magnitude_errors: tuple[float, ...]
    """|f| − g [m/s²], |ω| − Ω and ω upwards − Ω·sin L [rad/s]."""
    magnitude_sd: tuple[float, ...]
    """Standard uncertainties of `magnitude_errors`, in the same order and units."""
    step_deg: float | None = None
    """Step of the attitude within the recording; zero: none was seen; None: too few samples to look [deg]"""
    step_at_s: float | None = None
    """Time of the step since the recording's beginning; None: none was seen [s]"""
    step_by: str = ""
    """Sensors that saw the step: "accelerometers" or "gyros"."""
    step_visible_deg: float | None = None
    """Smallest tilt within the recording that would have been seen [deg]"""


class InitialAlignmentOfRecordingDocument(Part):
    """Every recording's attitude, in order."""

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
    attitudes: tuple[AlignedAttitude, ...]
    """Attitude of each recording"""


class InitialAlignmentOfRecordingResult(ResultHead):
    """A result: Initial alignment from a recording at rest."""

    kind: Literal["method"]
    name: Literal["initial_alignment_of_recording"]
    document: InitialAlignmentOfRecordingDocument
