"""Result of `calibration_12_orientations`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import (
    CalibrationSummaryCoefficient,
    Check,
    Form,
    Magnitudes,
    TriadCalibration,
    Verdict,
)


class StationResidual(Part):
    """Outputs minus model at one station, channels x, y, z, with their expected standard deviations."""

    label: str
    residual: tuple[float, ...]
    expected_sd: tuple[float, ...]


class ScalarParameter(Part):
    """Cross-check of one of the nine parameters: from magnitudes alone, from the linear fit, and their difference."""

    name: str
    unit: str
    scalar: float
    standard_uncertainty: float
    linear: float
    difference_sigmas: float


class ScalarCheck(Part):
    """The scalar calibration of the same stations, which trusts no angle of the table."""

    parameters: tuple[ScalarParameter, ...]
    condition: float
    p_value: float | None


class TriadSummary(Part):
    """Complete calibration results of one triad."""

    calibration: TriadCalibration
    coefficients: tuple[CalibrationSummaryCoefficient, ...]
    condition: float
    residuals: tuple[StationResidual, ...]
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    noise_known: bool
    magnitudes: Magnitudes
    scalar: ScalarCheck | None = None
    weighting: Literal["noise_and_table", "noise"] = "noise"
    misfit: float | None = None
    worst: str = ""


class ThermalShare(Part):
    """Effect of the thermal correction on a calibration, JSON-ready."""

    form: Form
    regime: str
    case_c: tuple[float, ...]
    converter_c: tuple[float, ...]
    change_m_s2: tuple[tuple[float, ...], ...]
    from_correction: dict[str, float]
    from_sensors: dict[str, float]


class Calibration12OrientationsDocument(Part):
    """Coefficients of both triads, their goodness of fit at the stations, and the verdict."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    triads: tuple[TriadSummary, ...]
    thermal: ThermalShare | None = None
    """of the accelerometers, where they were corrected"""


class Calibration12OrientationsResult(ResultHead):
    """A result: Calibration in twelve orientations."""

    kind: Literal["procedure"]
    name: Literal["calibration_12_orientations"]
    document: Calibration12OrientationsDocument
