"""Result of `free_inertial`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class Attitude(Part):
    """Attitude of the alignment [deg], heading clockwise from north."""

    heading_deg: float
    pitch_deg: float
    roll_deg: float


class FreeInertialDocument(Part):
    """Drift of the navigator beside its prediction."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    basis: str
    sentence: str
    attitude: Attitude
    alignment_s: float
    time_s: tuple[float, ...]
    north_m: tuple[float, ...]
    east_m: tuple[float, ...]
    radial_m: tuple[float, ...]
    velocity_north_m_s: tuple[float, ...]
    velocity_east_m_s: tuple[float, ...]
    radius_95_m: tuple[float, ...]
    mahalanobis: float
    p_value: float
    noise_known: bool


class FreeInertialResult(ResultHead):
    """A result: Free-inertial run over a recording at rest."""

    kind: Literal["method"]
    name: Literal["free_inertial"]
    document: FreeInertialDocument
