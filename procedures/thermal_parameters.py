"""Parameters of thermal tests that several procedures and methods share: legs of a profile, soaks, regimes, limits."""

from pydantic import Field

from procedures.core import units
from procedures.procedure import Parameters


class Leg(Parameters):
    """A ramp to an air temperature and a soak there; times run from setting out."""

    target_c: float = Field(ge=-100.0, le=200.0)
    ramp_c_min: float = Field(1.0, ge=0.01, le=100.0, description="rate of the chamber's set point")
    least_s: float = Field(0.0, ge=0.0, le=604_800.0, description="the leg is no shorter, however soon it has soaked")
    least_soak_s: float = Field(600.0, ge=0.0, le=604_800.0, description="time for which the criterion must hold")
    longest_s: float = Field(14_400.0, ge=60.0, le=604_800.0, description="with no soak by then the job fails")


def _leg(target_c: float, least_s: float) -> Leg:
    return Leg(target_c=target_c, ramp_c_min=1.0, least_s=least_s, least_soak_s=600.0, longest_s=least_s + units.HOUR)


DEFAULT_LEGS = (
    _leg(20.0, 2160.0),
    _leg(-40.0, 8460.0),
    *(_leg(target, 5100.0) for target in (-20.0, 0.0, 20.0, 40.0, 60.0)),
    _leg(20.0, 7080.0),
)
"""Twelve hours: within these least times a unit with a case time constant of some twenty minutes soaks at every leg."""


class Soak(Parameters):
    """Soak criterion of the unit, judged from its own case and converter sensors every ten seconds."""

    slope_c_min: float = Field(0.1, ge=1e-4, le=100.0, description="most that either sensor may drift")
    window_s: float = Field(300.0, ge=60.0, le=86_400.0, description="window of the straight line whose slope that is")
    air_within_c: float = Field(1.5, ge=0.01, le=100.0, description="chamber's air about the target")


class Regime(Parameters):
    """Settings of the regime indicator of thesis 3.18."""

    memory_s: float = Field(120.0, ge=3.0, le=86_400.0)
    enter_c_s2: float = Field(4.0e-6, gt=0.0, le=1.0)
    release_c_s2: float = Field(2.5e-6, gt=0.0, le=1.0)
    release_rate_c_s: float = Field(2.5e-3, gt=0.0, le=1e3)
    hold_s: float = Field(300.0, ge=0.0, le=86_400.0)


class Limits(Parameters):
    """Requirements (thesis 4.3, 5.6; tests at the level of significance are this program's own)."""

    three_sigma_m_s2: float = Field(
        0.0005, gt=0.0, le=100.0, description="largest 3σ of each axis after correction, at the worst soak"
    )
    magnitude_rms_m_s2: float = Field(
        0.0005, gt=0.0, le=100.0, description="largest rms of |ĝ| about its mean, of the worst run"
    )
    allan_rise: float = Field(
        1.0, gt=0.0, le=1e6, description="least sure deviation at a longer time over the most at a shorter one"
    )
    gyro_random_walk_deg_sqrt_h: float = Field(0.003, gt=0.0, le=1e6)
    gyro_bias_in_run_deg_h: float = Field(0.015, gt=0.0, le=1e6, description="bias instability in the cycle")
