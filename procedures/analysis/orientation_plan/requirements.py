"""Limits on a calibration compared with its plan: those that it cannot resolve, and the check of the bias in run."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, chdtri

from procedures.analysis.calibration.magnitude import magnitude_covariance, magnitude_gradient
from procedures.analysis.calibration.plan import TriadPlan, in_sample_covariance
from procedures.analysis.calibration.reference import INPUT_UNITS
from procedures.analysis.calibration.station_plan import dwell_for
from procedures.analysis.calibration.verification import effective_freedom, predicted_sd
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.limits import Limit, PlannedCheck

BIASES = (0, 4, 8)
SCALE_FACTORS = (1, 6, 11)
IN_RUN_SOURCE = "thesis 4.3, 5.1"
IN_RUN_LEVEL = 0.001
RARE = 0.01
"""Chance that a sound unit fails a check, below which a plan does not mention it."""

_TURNS = (
    "whole turns of the table at a known rate determine it instead (procedure scale_factor_whole_turns: ±n·360°, the "
    "Earth's rate cancels; IEEE Std 647)"
)


@dataclass(frozen=True)
class Requirement:
    """A limit on the scatter of a coefficient between calibrations: the plan must be finer than it."""

    triad: str
    name: str
    columns: tuple[int, ...]
    limit: float
    """Limit in SI units; relative for a scale factor."""
    display: str
    display_size: float


def run_to_run_requirements(
    gyro_bias_deg_h: float,
    gyro_scale_ppm: float | None,
    accelerometer_bias_m_s2: float,
    accelerometer_scale_ppm: float,
) -> tuple[Requirement, ...]:
    """Return the limits on stability from launch to launch (thesis 4.3, 5.6); without that of the gyro scale where
    None.
    """
    deg_h, ppm = units.DEG_PER_HOUR, units.PPM
    scale = () if gyro_scale_ppm is None else (gyro_scale_ppm * ppm,)
    return (
        Requirement("gyro", "bias", BIASES, gyro_bias_deg_h * deg_h, "deg/h", deg_h),
        *(Requirement("gyro", "scale factor", SCALE_FACTORS, limit, "ppm", ppm) for limit in scale),
        Requirement("accelerometer", "bias", BIASES, accelerometer_bias_m_s2, "m/s^2", 1.0),
        Requirement("accelerometer", "scale factor", SCALE_FACTORS, accelerometer_scale_ppm * ppm, "ppm", ppm),
    )


def unresolved(plan: TriadPlan, requirement: Requirement) -> str | None:
    """Warning where the plan is coarser than a limit: the expected value, and a sufficient dwell, if there is one.

    Only the scatter from one calibration to the next counts: noise, and the table's pointing; constant flaws of
    the table do not. Only the noise falls with the dwell.
    """

    def uncertainty(dwell_s: float | None) -> float:
        scatter = plan.scatter(dwell_s)
        if scatter is None:
            return 0.0
        columns = list(requirement.columns)
        variance = scatter.noise_variance[columns] + scatter.pointing[columns] ** 2
        size = np.diagonal(plan.matrix) if requirement.display == "ppm" else np.ones(3)
        return float(np.max(np.sqrt(variance) / np.abs(size)))

    expected = uncertainty(None)
    if expected <= requirement.limit:
        return None
    r = requirement
    planned = {s.record_s for s in plan.stations}
    dwell = dwell_for(uncertainty, r.limit, max(planned), expected if len(planned) == 1 else None)
    way_out = (
        f"a dwell of about {_length(dwell)} at each station would be needed{_alone(r)}"
        if dwell is not None
        else f"no dwell gets there{_alone(r)}"
    )
    turns = f"; {_TURNS}" if r.triad == "gyro" and r.name == "scale factor" else ""
    return (
        f"{r.triad} {r.name} run to run: the limit of {r.limit / r.display_size:g} {r.display} cannot be resolved, "
        f"the plan's standard uncertainty is {expected / r.display_size:.3g} {r.display}; {way_out}{turns}"
    )


def in_run_unresolved(
    plan: TriadPlan, limit: float, display: str, display_size: float, *, in_sample: bool = False
) -> str | None:
    """Return a warning where the noise of the dwells alone takes a per-axis figure δ/√3 (thesis 5.1) past its limit
    [SI]; else None.

    `in_sample`: of a calibration at its own stations, which follows a part of the noise.
    """
    covariance = in_sample_covariance(plan) if in_sample else _of_dwells(plan)
    if covariance is None:
        return None
    expected = predicted_sd(covariance) / float(np.sqrt(3.0))
    if expected <= limit:
        return None
    return (
        f"{plan.triad} bias in run: the limit of {limit / display_size:g} {display} cannot be resolved, the noise of "
        f"the dwells alone makes δ/√3 about {expected / display_size:.3g} {display}"
    )


def _of_dwells(plan: TriadPlan) -> Array | None:
    """Covariance (n, n) of magnitudes by the noise of the dwells alone; None where it is not known."""
    noise = plan.noise_covariance()
    gradient = magnitude_gradient(plan.vectors, np.linalg.inv(plan.matrix))
    return None if noise is None else magnitude_covariance(gradient, noise)


def in_run_check(
    plan: TriadPlan,
    maximum: float | None,
    covariance: Array | None,
    level: float = IN_RUN_LEVEL,
    source: str = IN_RUN_SOURCE,
) -> PlannedCheck:
    """Planned check of the error per axis δ/√3 of n stations, its limit in the triad's unit of display.

    δ² is a mean square of the degrees of freedom of `effective_freedom`; its part of the measurement has errors of
    magnitude with the `covariance` (n, n), None where the noise is not known. Without a maximum the limit is the plan's
    expanded uncertainty: what a sound unit exceeds with the probability `level`, ``k² = χ²_ν(1 − level)/ν``.
    (k = 2 would not do: where six coefficients that change between launches move all stations, ν is near 2 and one
    sound unit in fifty exceeds it.) Raises `BadParameter` where the uncertainty is not known.
    """
    display, size = units.DISPLAY[INPUT_UNITS[plan.triad]]
    name = f"{plan.triad} bias in run, δ/√3"
    floor = None if covariance is None else predicted_sd(covariance) / float(np.sqrt(3.0)) / size
    freedom = None if covariance is None else effective_freedom(covariance)
    own = None
    if maximum is not None:
        limit = Limit(display, maximum=maximum, source=source)
    elif floor is not None and freedom is not None:
        factor, own = float(np.sqrt(chdtri(freedom, level) / freedom)), level
        source = f"expanded uncertainty of the plan, k = {factor:.3g} at a level of {level:g} (ν = {freedom:.2g})"
        limit = Limit(display, maximum=factor * floor, source=source)
    else:
        field = f"limits.{plan.triad}_bias_in_run_{'deg_h' if plan.triad == 'gyro' else 'm_s2'}"
        raise BadParameter(field, None, "a number: the noise is not known, so the plan has no uncertainty to take")
    return PlannedCheck(name, limit, floor, freedom, 0.0, own)


def sound_unit_fails(planned: PlannedCheck) -> float | None:
    """Chance that a sound unit exceeds the limit of a root mean square; None where the plan does not predict it.

    ``P(χ²_ν > ν·limit²/u²)`` with the u that the plan predicts and its effective degrees of freedom ν: an approximation
    by two moments, good to about a percentage point (Satterthwaite). A sound unit's true value is zero.
    """
    u, freedom, limit = planned.standard_uncertainty, planned.degrees_of_freedom, planned.limit.maximum
    if u is None or freedom is None or limit is None:
        return None
    return float(chdtrc(freedom, freedom * (limit / u) ** 2)) if u > 0.0 else 0.0


def chance_of_failure(planned: PlannedCheck) -> str | None:
    """Warning where a sound unit fails a planned check oftener than `RARE`, with the chance and what makes it."""
    chance = sound_unit_fails(planned)
    if chance is None or chance < RARE:
        return None
    limit = planned.limit
    return (
        f"{planned.check}: a sound unit exceeds the limit of {limit.maximum:g} {limit.unit} with a chance of about "
        f"{100.0 * chance:.2g} %, for noise, the calibration's uncertainty and the unit's change between launches make "
        f"about {planned.standard_uncertainty:.2g} {limit.unit}: such a FAIL alone is no fault of the unit"
    )


def chances_of_failure(planned: Sequence[PlannedCheck]) -> tuple[str, ...]:
    """Warnings of all planned checks that a sound unit fails oftener than `RARE`."""
    found = (chance_of_failure(one) for one in planned)
    return tuple(warning for warning in found if warning is not None)


def _length(dwell_s: float) -> str:
    """Format a dwell in the unit that a person would plan it in."""
    hours = dwell_s / units.HOUR
    return f"{hours:.2g} h" if hours < 48.0 else f"{hours / 24.0:.0f} days"


def _alone(requirement: Requirement) -> str:
    return " by the Earth's rate alone" if requirement.triad == "gyro" else ""
