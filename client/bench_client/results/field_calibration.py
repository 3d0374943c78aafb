"""Result of `field_calibration`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, TriadCalibration, Verdict


class FieldTriad(Part):
    """Bias and scale of one triad with standard uncertainties, and the tilt of the base by this triad."""

    calibration: TriadCalibration
    """Calibration of the triad"""
    bias: tuple[float, ...]
    """Bias b, in the output unit"""
    bias_sd: tuple[float, ...]
    """Standard uncertainty of the bias"""
    scale: tuple[float, ...]
    """Scale factors x, y, z, relative to nominal"""
    scale_relative_sd: tuple[float, ...]
    """Relative standard uncertainty of the scale factors"""
    scale_estimated: bool
    """Whether the scale factors were estimated"""
    chi_square: float
    """Weighted sum of squared residuals"""
    degrees_of_freedom: int
    """Degrees of freedom"""
    p_value: float | None
    """p-value: probability that noise alone gives a statistic at least this large"""
    residuals: tuple[tuple[float, ...], ...]
    """Per recording, in the output's unit."""
    misfit: float | None = None
    """Residuals over what noise and declared uncertainties allow; None where no equation is spare."""
    worst: str = ""
    """Position and channel with the greatest residual."""
    suspected: str = ""
    """A mistake in the positions that would explain a misfit."""


class FieldCalibrationDocument(Part):
    """The triads, and the tilt where it was estimated."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    triads: tuple[FieldTriad, ...]
    """Triads, one entry each"""
    tilt_deg: tuple[float, ...] | None
    """Tilt of the base (α₀, β₀); None: taken as level [deg]"""
    tilt_sd_deg: tuple[float, ...] | None
    """Standard uncertainty of the tilt [deg]"""
    tilt_model: str
    """Model of the base: level, base or turn_zeros"""


class FieldCalibrationResult(ResultHead):
    """A result: Field calibration."""

    kind: Literal["method"]
    name: Literal["field_calibration"]
    document: FieldCalibrationDocument
