"""Result of `field_calibration`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, TriadCalibration, Verdict


class FieldTriad(Part):
    """Bias and scale of one triad with standard uncertainties, and the tilt of the base by this triad."""

    calibration: TriadCalibration
    bias: tuple[float, ...]
    bias_sd: tuple[float, ...]
    scale: tuple[float, ...]
    scale_relative_sd: tuple[float, ...]
    scale_estimated: bool
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    residuals: tuple[tuple[float, ...], ...]
    misfit: float | None = None
    worst: str = ""
    suspected: str = ""


class FieldCalibrationDocument(Part):
    """The triads, and the tilt where it was estimated."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    triads: tuple[FieldTriad, ...]
    tilt_deg: tuple[float, ...] | None
    tilt_sd_deg: tuple[float, ...] | None
    tilt_model: str


class FieldCalibrationResult(ResultHead):
    """A result: Field calibration."""

    kind: Literal["method"]
    name: Literal["field_calibration"]
    document: FieldCalibrationDocument
