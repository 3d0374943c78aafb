"""Result of `scale_factor_whole_turns`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import CalibrationSummaryCoefficient, Check, Statement, TriadCalibration, Verdict


class RatePoint(Part):
    """Scale factor of one axis at one rate and direction, as a departure from the fitted K."""

    axis: str
    rate_deg_s: float
    turns: int
    departure: float
    standard_uncertainty: float
    modelled: float


class WholeTurns(Part):
    """Complete results of whole turns for a gyro triad."""

    coefficients: tuple[CalibrationSummaryCoefficient, ...]
    calibration: TriadCalibration
    reference_rate_deg_s: float
    points: tuple[RatePoint, ...]
    condition: float
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    noise_known: bool


class ScaleFactorWholeTurnsDocument(Part):
    """The gyro triad's coefficients, the scale factor at each rate, and the verdict."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    gyro: WholeTurns
    make_calibration: bool = False


class ScaleFactorWholeTurnsResult(ResultHead):
    """A result: Gyro scale factor by whole turns."""

    kind: Literal["procedure"]
    name: Literal["scale_factor_whole_turns"]
    document: ScaleFactorWholeTurnsDocument
