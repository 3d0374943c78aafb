"""Prediction of whole turns: the program of turns, its uncertainties, and the limits that it cannot resolve."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import floor

import numpy as np

from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.station_plan import windows
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.turns.fit import Term, TurnEstimator, parameter_names, turn_estimator, turn_flaws, turning
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.recording import AXES, Station
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn
from procedures.core.unit import Unit

UPRIGHT = {"x": TableAngles(0.0, 90.0, 0.0), "y": TableAngles(), "z": TableAngles(0.0, 0.0, -90.0)}
"""Table attitude in which each axis of the unit points upwards, along the table's outer axis."""
MOST_TIMES_LONGER = 64
"""Factor on the turning time beyond which a plan is reported as hopeless."""


@dataclass(frozen=True)
class TurnProgram:
    """Turn program, the same turns about each axis of the unit: every rate in both directions."""

    rates_deg_s: tuple[float, ...]
    turning_s: float
    """Duration of the turns at each rate, to the nearest whole turn [s]."""
    ramp_s: float
    rest_s: float
    """Time at rest at the end of each recording [s]."""
    settle_s: float

    def turns(self, rate_deg_s: float) -> int:
        """Return the number of whole turns at a rate, at least one."""
        return max(1, floor(rate_deg_s * self.turning_s / 360.0 + 0.5))

    def stations(self) -> tuple[Station, ...]:
        """Return the stations, axis after axis, rate after rate, forth and back. Raises `BadParameter` where a rate
        would not be reached.
        """
        made: list[Station] = []
        for axis, angles in UPRIGHT.items():
            for rate in self.rates_deg_s:
                for sign in (1, -1):
                    turn = self._turn(sign * self.turns(rate), rate)
                    label = f"{axis} {sign * rate:+g} deg/s, {turn.turns:+d} turns"
                    record_s = turn.duration_s + self.rest_s
                    made.append(Station(len(made), label, angles, None, self.settle_s, record_s, turn=turn))
        return tuple(made)

    def _turn(self, turns: int, rate_deg_s: float) -> Turn:
        try:
            return Turn("outer", turns, rate_deg_s, self.ramp_s)
        except ValueError as refusal:
            raise BadParameter("turning_s", self.turning_s, str(refusal)) from refusal


@dataclass(frozen=True)
class TurnPlan:
    """Plan of a program on a unit and a bench."""

    program: TurnProgram
    unit: Unit
    axes: tuple[tuple[float, float], ...]
    """(rate, acceleration) of the table's axes, for the time that moves take."""
    site: Site
    uncertainty: TableUncertainty
    terms: tuple[Term, ...]
    reference_rad_s: float
    cross_coupling_sd: float = 0.0
    """Standard uncertainty of each cross-coupling of a unit without a calibration."""

    def estimator(self) -> TurnEstimator | None:
        """Predicted estimator of the plan; None where the unit's noise is not known. Raises `Undetermined`.

        K is that of the current calibration, else the identity (nominal outputs) with cross-couplings of
        `cross_coupling_sd`: they carry the table's orthogonality into the scale factors.
        """
        stations = self.program.stations()
        spans = windows(stations, self.axes)
        motion = turning(stations, spans[:, 1] - spans[:, 0], self.site)
        noise = triad_covariance(self.unit.gyro, spans)
        known = self.unit.known_matrix("gyro")
        matrix = np.eye(3) if known is None else known
        flaws = turn_flaws(motion, self.uncertainty)
        slopes = motion.axis_b @ matrix.T
        cross_sd = self.cross_coupling_sd if known is None else 0.0
        made = turn_estimator(motion, slopes, self.terms, self.reference_rad_s, noise, flaws, matrix, cross_sd)
        return None if noise is None else made

    def times_longer(self, factor: int) -> "TurnPlan":
        """Return the plan with the same rates, each for `factor` times as long."""
        return replace(self, program=replace(self.program, turning_s=factor * self.program.turning_s))


def coefficient_names(terms: Sequence[Term]) -> tuple[str, ...]:
    """Return the coefficient names of all three channels: "b_x", "K11", …, "asymmetry_x", …"""
    return tuple(
        f"K{number}{name[1]}" if name.startswith("K") else f"{name}_{axis}"
        for number, axis in enumerate(AXES, start=1)
        for name in parameter_names(terms)
    )


def scale_factor_sd(made: TurnEstimator, terms: Sequence[Term]) -> tuple[float, float, float]:
    """Return the standard uncertainties of K11, K22, K33."""
    sd = np.sqrt(np.diagonal(made.covariance))
    names = coefficient_names(terms)
    x, y, z = (float(sd[names.index(f"K{i}{i}")]) for i in (1, 2, 3))
    return x, y, z


def longer_needed(plan: TurnPlan, limit: float) -> int | None:
    """Factor on the turning time by which 3σ of every scale factor comes within a relative limit.

    To the next power of two; None where `MOST_TIMES_LONGER` is too short, or the noise is not known.
    """
    factor = 2
    while factor <= MOST_TIMES_LONGER:
        longer = plan.times_longer(factor)
        made = longer.estimator()
        if made is None:
            return None
        if 3.0 * max(scale_factor_sd(made, plan.terms)) <= limit:
            return factor
        factor *= 2
    return None


def bench_time_s(plan: TurnPlan) -> tuple[float, tuple[float, ...]]:
    """Return the bench time of the whole plan and of each axis of the unit, moves and settling included [s]."""
    stations = plan.program.stations()
    ends = windows(stations, plan.axes)[:, 1]
    per_axis = np.diff([0.0, *ends[len(stations) // 3 - 1 :: len(stations) // 3].tolist()])
    return float(ends[-1]), tuple(per_axis.tolist())


def too_coarse(plan: TurnPlan, made: TurnEstimator, limit_ppm: float) -> str | None:
    """Warning where 3σ of a scale factor passes its limit [ppm]: expected value, its noise part, a sufficient plan.

    `made` is the plan's estimator. None where it does not pass the limit.
    """
    expected = 3.0 * max(scale_factor_sd(made, plan.terms)) / units.PPM
    if expected <= limit_ppm:
        return None
    factor = longer_needed(plan, limit_ppm * units.PPM)
    way_out = (
        "no length of turning gets there"
        if factor is None
        else f"turning_s = {factor * plan.program.turning_s:g} would do"
    )
    names = coefficient_names(plan.terms)
    own = [names.index(f"K{i}{i}") for i in (1, 2, 3)]
    of_noise = 3.0 * float(np.max(np.sqrt(np.diagonal(made.noise_covariance)[own]))) / units.PPM
    return (
        f"gyro scale factor: 3σ is to be within {limit_ppm:g} ppm and the plan's is {expected:.3g} ppm, of noise "
        f"alone {of_noise:.3g} ppm, the rest of the table; {way_out}"
    )
