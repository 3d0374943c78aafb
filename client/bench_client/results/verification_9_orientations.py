"""Result of `verification_9_orientations`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Magnitudes, Verdict


class TriadVerification(Part):
    """Verification result of one triad, JSON-ready."""

    magnitudes: Magnitudes
    chi_square: float | None
    p_value: float | None
    run_to_run_known: bool


class Verification9OrientationsDocument(Part):
    """Magnitudes of both triads before and after correction, and their agreement with the prediction."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    triads: tuple[TriadVerification, ...]


class Verification9OrientationsResult(ResultHead):
    """A result: Verification in nine orientations."""

    kind: Literal["procedure"]
    name: Literal["verification_9_orientations"]
    document: Verification9OrientationsDocument
