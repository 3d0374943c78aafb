"""Result of `plan_orientations`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class TriadWorth(Part):
    """Performance of one triad under one plan: worst uncertainty over limit, improvement, bound."""

    triad: str
    """Triad: gyro or accelerometer"""
    worst: float
    """Greatest standard uncertainty over its limit."""
    improvement: float
    """Ratio of the reference's worst to this."""
    bound: float
    """Lower bound of the worst for any plan of as many stations in this time."""
    standard_uncertainties: tuple[float, ...]
    """Standard uncertainties of the twelve (b, K_i1, K_i2, K_i3 by channel) or the scalar nine (b, s, t), SI."""


class Plan(Part):
    """Plan of orientations in order; (outer, middle, inner) in degrees."""

    name: str
    """Name"""
    orientations_deg: tuple[tuple[float, ...], ...]
    """Orientations of the plan [deg]"""
    dwell_s: float
    """Dwell at each station [s]"""
    improvement: float
    """Improvement of the worst coefficient over all triads."""
    triads: tuple[TriadWorth, ...]
    """Triads, one entry each"""


class PlanOrientationsDocument(Part):
    """The plan to beat first, then a plan for every number of stations, and which of them is recommended."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    model: str
    """Model of the plan: linear, linear_with_table or scalar"""
    total_s: float
    """Bench time that every plan takes [s]"""
    plans: tuple[Plan, ...]
    """Plans"""
    recommended: int
    """Index of the recommended plan in `plans`."""
    sentence: str
    """The finding, as a sentence"""


class PlanOrientationsResult(ResultHead):
    """A result: Better orientations."""

    kind: Literal["method"]
    name: Literal["plan_orientations"]
    document: PlanOrientationsDocument
