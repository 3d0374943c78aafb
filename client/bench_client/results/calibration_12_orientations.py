"""Result of `calibration_12_orientations`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Form, Statement, TriadSummary, Verdict


class ThermalShare(Part):
    """Effect of the thermal correction on a calibration, JSON-ready."""

    form: Form
    regime: str
    case_c: tuple[float, ...]
    converter_c: tuple[float, ...]
    change_m_s2: tuple[tuple[float, ...], ...]
    from_correction: dict[str, float]
    from_sensors: dict[str, float]


class DwellEnded(Part):
    """Duration of one dwell under a stop rule."""

    label: str
    duration_s: float
    longest_s: float
    by_rule: bool


class DwellsSaved(Part):
    """Time that a stop rule saved in a job."""

    dwells: tuple[DwellEnded, ...]
    saved_s: float
    share: float


class Calibration12OrientationsDocument(Part):
    """Coefficients of both triads, their goodness of fit at the stations, and the verdict."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    triads: tuple[TriadSummary, ...]
    thermal: ThermalShare | None = None
    """thermal correction of the accelerometers, where it was applied"""
    dwells: DwellsSaved | None = None
    """dwells ended by the stop rule, and the time saved"""


class Calibration12OrientationsResult(ResultHead):
    """A result: Calibration in twelve orientations."""

    kind: Literal["procedure"]
    name: Literal["calibration_12_orientations"]
    document: Calibration12OrientationsDocument
