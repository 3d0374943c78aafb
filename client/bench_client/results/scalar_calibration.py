"""Result of `scalar_calibration`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, TriadCalibration, Verdict


class Estimate(Part):
    """Coefficient of the scalar model, one of nine."""

    name: str
    unit: str
    estimate: float
    standard_uncertainty: float


class ScalarCalibrationDocument(Part):
    """``v̂ = T·S·(U − b)``, T upper triangular with a unit diagonal."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    calibration: TriadCalibration
    parameters: tuple[Estimate, ...]
    reference: float
    poses: int
    condition: float
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    residuals: tuple[float, ...]
    residual_sd: tuple[float, ...]
    misfit: float | None = None
    worst: str = ""


class ScalarCalibrationResult(ResultHead):
    """A result: Scalar calibration."""

    kind: Literal["method"]
    name: Literal["scalar_calibration"]
    document: ScalarCalibrationDocument
