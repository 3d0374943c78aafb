"""Result of `calibration_12_orientations`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, ThermalShare, TriadSummary, Verdict


class DwellEnded(Part):
    """Duration of one dwell under a stop rule."""

    label: str
    """Name for people"""
    duration_s: float
    """Duration [s]"""
    longest_s: float
    """Longest allowed dwell [s]"""
    by_rule: bool
    """True if the rule ended it; False if it ran to its longest time."""


class DwellsSaved(Part):
    """Time that a stop rule saved in a job."""

    dwells: tuple[DwellEnded, ...]
    """Dwells, in order"""
    saved_s: float
    """Sum of what the dwells were shorter than their longest time [s]"""
    share: float
    """Part of the longest time of all dwells together."""


class Calibration12OrientationsDocument(Part):
    """Coefficients of both triads, their goodness of fit at the stations, and the verdict."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error; null: open, or nothing was judged"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """statement of conformity; None without checks and in results of older versions"""
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
