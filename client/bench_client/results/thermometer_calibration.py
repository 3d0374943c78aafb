"""Result of `thermometer_calibration`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, ThermometerCorrection, Verdict


class SensorFit(Part):
    """Line of one sensor through its soaks: offset, slope, errors, test of straightness."""

    channel: str
    """Name of the channel"""
    offset_c: float
    """Error on the fitted line at the reference temperature [°C]"""
    offset_sd_c: float
    """Standard uncertainty of that error [°C]"""
    slope: float
    """Slope of the error against the reading"""
    slope_sd: float
    """Standard uncertainty of the slope"""
    error_c: tuple[float, ...]
    """Reading at switching on less the chamber's air, at each soak [°C]"""
    error_sd_c: tuple[float, ...]
    """Standard uncertainty of each error [°C]"""
    residual_c: tuple[float, ...]
    """Error less the fitted line, at each soak [°C]"""
    p_value: float
    """Chance of residuals as large, were all errors as large as claimed (chi-square of n − 2)."""


class UpAgainstDown(Part):
    """Difference of a sensor's errors at one temperature reached from below and from above."""

    channel: str
    """Name of the channel"""
    target_c: float
    """Temperature of the soak by the plan [°C]"""
    difference_c: float
    """Error on the way up less that on the way down [°C]"""
    standard_uncertainty_c: float
    """Standard uncertainty [°C]"""
    p_value: float
    """p-value: probability that noise alone gives a statistic at least this large"""


class Calibrated(Part):
    """Calibration of all temperature sensors of a unit: lines, correction, hysteresis."""

    sensors: tuple[SensorFit, ...]
    """Thermometers, one entry each"""
    correction: ThermometerCorrection
    """The correction"""
    hysteresis: tuple[UpAgainstDown, ...]
    """Difference between soaks reached from below and from above"""
    unsoaked_c: tuple[float, ...]
    """Greatest rest of the step before each soak that the unit had not followed [°C]"""


class ThermometerCalibrationDocument(Part):
    """Calibration of the unit's thermometers."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    thermometers: Calibrated
    """Calibration of the thermometers"""
    target_c: tuple[float, ...]
    """Temperature of the soak by the plan [°C]"""
    air_c: tuple[float, ...]
    """Chamber's own readings at the soaks [°C]"""


class ThermometerCalibrationResult(ResultHead):
    """A result: Calibration of the unit's thermometers."""

    kind: Literal["procedure"]
    name: Literal["thermometer_calibration"]
    document: ThermometerCalibrationDocument
