"""Result of `calibration_12_orientations`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, DwellsSaved, Statement, ThermalShare, TriadSummary, Verdict


class Calibration12OrientationsDocument(Part):
    """Coefficients of both triads, their goodness of fit at the stations, and the verdict."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    triads: tuple[TriadSummary, ...]
    """Triads, one entry each"""
    thermal: ThermalShare | None = None
    """thermal correction of the accelerometers, where it was applied"""
    dwells: DwellsSaved | None = None
    """dwells ended by the stop rule, and the time saved"""


class Calibration12OrientationsResult(ResultHead):
    """A result: Calibration in twelve orientations."""

    kind: Literal["procedure"]
    name: Literal["calibration_12_orientations"]
    document: Calibration12OrientationsDocument
