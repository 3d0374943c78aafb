"""Result of `thermometer_calibration`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, ThermometerCorrection, Verdict


class SensorFit(Part):
    """Line of one sensor through its soaks."""

    channel: str
    offset_c: float
    offset_sd_c: float
    slope: float
    slope_sd: float
    error_c: tuple[float, ...]
    error_sd_c: tuple[float, ...]
    residual_c: tuple[float, ...]
    p_value: float


class UpAgainstDown(Part):
    """Difference of a sensor's errors at one temperature reached from below and from above."""

    channel: str
    target_c: float
    difference_c: float
    standard_uncertainty_c: float
    p_value: float


class Calibrated(Part):
    """The sensors' calibration as a whole."""

    sensors: tuple[SensorFit, ...]
    correction: ThermometerCorrection
    hysteresis: tuple[UpAgainstDown, ...]
    unsoaked_c: tuple[float, ...]


class ThermometerCalibrationDocument(Part):
    """Calibration of the unit's thermometers."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    thermometers: Calibrated
    target_c: tuple[float, ...]
    air_c: tuple[float, ...]


class ThermometerCalibrationResult(ResultHead):
    """A result: Calibration of the unit's thermometers."""

    kind: Literal["procedure"]
    name: Literal["thermometer_calibration"]
    document: ThermometerCalibrationDocument
