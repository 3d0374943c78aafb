"""Result of `scalar_calibration`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, TriadCalibration, Verdict


class Estimate(Part):
    """Coefficient of the scalar model, one of nine."""

    name: str
    """Name"""
    unit: str
    """Unit of measurement"""
    estimate: float
    """Estimated value, in `unit`"""
    standard_uncertainty: float
    """Standard uncertainty, in the unit of the value"""


class ScalarCalibrationDocument(Part):
    """``v̂ = T·S·(U − b)``, T upper triangular with a unit diagonal."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    calibration: TriadCalibration
    """Calibration of the triad"""
    parameters: tuple[Estimate, ...]
    """b in the output's unit, s in SI per output unit, t in rad."""
    reference: float
    """Reference value: gravity or the Earth's rate"""
    poses: int
    """Number of poses"""
    condition: float
    """Condition number of the column-scaled design"""
    chi_square: float
    """Weighted sum of squared residuals"""
    degrees_of_freedom: int
    """Degrees of freedom"""
    p_value: float | None
    """p-value: probability that noise alone gives a statistic at least this large"""
    residuals: tuple[float, ...]
    """|v̂| − reference per pose, SI."""
    residual_sd: tuple[float, ...]
    """Expected standard deviation of each residual"""
    misfit: float | None = None
    """Residuals over what the scatter within the poses allows; None where no equation is spare."""
    worst: str = ""
    """Pose and channels with the greatest residual."""


class ScalarCalibrationResult(ResultHead):
    """A result: Scalar calibration."""

    kind: Literal["method"]
    name: Literal["scalar_calibration"]
    document: ScalarCalibrationDocument
