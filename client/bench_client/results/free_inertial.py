"""Result of `free_inertial`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class Attitude(Part):
    """Attitude of the alignment [deg], heading clockwise from north."""

    heading_deg: float
    """Heading, from north [deg]"""
    pitch_deg: float
    """Pitch [deg]"""
    roll_deg: float
    """Roll [deg]"""


class FreeInertialDocument(Part):
    """Drift of the navigator beside its prediction."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    basis: str
    """Basis of the uncertainties, as a sentence"""
    sentence: str
    """The finding, as a sentence"""
    attitude: Attitude
    """Attitude by the alignment"""
    alignment_s: float
    """Duration of the alignment at the beginning of the recording [s]"""
    time_s: tuple[float, ...]
    """Times since the alignment's end at which all curves are given [s]"""
    north_m: tuple[float, ...]
    """Distance to the north from the start, at each time [m]"""
    east_m: tuple[float, ...]
    """Distance to the east from the start, at each time [m]"""
    radial_m: tuple[float, ...]
    """Distance from the start, at each time [m]"""
    velocity_north_m_s: tuple[float, ...]
    """Velocity to the north, at each time [m/s]"""
    velocity_east_m_s: tuple[float, ...]
    """Velocity to the east, at each time [m/s]"""
    radius_95_m: tuple[float, ...]
    """Predicted radius of the circle about the start that holds the position with 95 %, at `time_s` [m]"""
    mahalanobis: float
    """Distance of the last position in standard deviations of the prediction, ``√(eᵀP⁻¹e)``."""
    p_value: float
    """Chance of a distance at least as large; a lower figure where the noise is not known."""
    noise_known: bool
    """Whether the noise is that of the unit's record"""


class FreeInertialResult(ResultHead):
    """A result: Free-inertial run over a recording at rest."""

    kind: Literal["method"]
    name: Literal["free_inertial"]
    document: FreeInertialDocument
