"""Result of `plan_orientations`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class TriadWorth(Part):
    """Performance of one triad under one plan."""

    triad: str
    worst: float
    improvement: float
    bound: float
    standard_uncertainties: tuple[float, ...]


class Plan(Part):
    """Plan of orientations in order; (outer, middle, inner) in degrees."""

    name: str
    orientations_deg: tuple[tuple[float, ...], ...]
    dwell_s: float
    improvement: float
    triads: tuple[TriadWorth, ...]


class PlanOrientationsDocument(Part):
    """The plan to beat first, then a plan for every number of stations, and which of them is recommended."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    model: str
    total_s: float
    plans: tuple[Plan, ...]
    recommended: int
    sentence: str


class PlanOrientationsResult(ResultHead):
    """A result: Better orientations."""

    kind: Literal["method"]
    name: Literal["plan_orientations"]
    document: PlanOrientationsDocument
