"""Result of `thermal_correction_of_recordings`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, ThermalCorrection, Verdict


class AxisResult(Part):
    """Fit of one accelerometer: uncertainties, spread before and after, tests of the order."""

    axis: str
    """Axis of the unit"""
    standard_uncertainties: tuple[float, ...]
    """Standard uncertainties of α1 … α4, β1 … β4."""
    before_sd_m_s2: float
    """Spread of the cells about their recording's mean [m/s²]"""
    static_sd_m_s2: float | None
    """Root mean square of the residuals while the temperature stands; None where it never does [m/s²]"""
    dynamic_sd_m_s2: float | None
    """Standard deviation of the residuals in the dynamic regime [m/s²]"""
    condition: float
    """Condition number of the column-scaled design"""
    bic: tuple[float, ...]
    """Information criterion of the orders 1 … 5."""
    f_tests: tuple[float, ...]
    """p-value of F tests of each order against the next lower one"""
    preferred_order: int
    """Order that the information criterion prefers"""
    reason: str
    """Reason, as a sentence"""


class ThermalCorrectionOfRecordingsDocument(Part):
    """The correction, how well it fits each axis, and the temperatures that it was fitted at."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    correction: ThermalCorrection
    """The correction"""
    axes: tuple[AxisResult, ...]
    """Correction of each axis, x, y, z"""
    sensors: tuple[str, ...]
    """Thermometers, one entry each"""
    thermometers: str
    """Id of the calibration of thermometers that was used; empty: readings as they are."""


class ThermalCorrectionOfRecordingsResult(ResultHead):
    """A result: Thermal correction of the accelerometers, of recordings."""

    kind: Literal["method"]
    name: Literal["thermal_correction_of_recordings"]
    document: ThermalCorrectionOfRecordingsDocument
