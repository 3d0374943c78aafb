"""Prediction of a calibration: the uncertainty of every coefficient, and the limits that it cannot resolve."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from scipy.special import chdtri

from procedures.analysis.calibration.estimator import Estimator, TableShare, Weighting, estimator, table_share
from procedures.analysis.calibration.magnitude import magnitude_covariance, magnitude_gradient
from procedures.analysis.calibration.reference import INPUT_UNITS, reference_vectors
from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.station_plan import dwell_for, windows
from procedures.analysis.calibration.table_errors import TableErrors, TableUncertainty, table_errors
from procedures.analysis.calibration.verification import effective_freedom, predicted_sd
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.limits import Limit, PlannedCheck
from procedures.core.recording import Station
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.unit import Unit

MOST_SCATTERS = 1000
"""Dwells of one plan whose scatter is kept."""
BIASES = (0, 4, 8)
SCALE_FACTORS = (1, 6, 11)

_TURNS = (
    "whole turns of the table at a known rate determine it instead (procedure scale_factor_whole_turns: ±n·360°, the "
    "Earth's rate cancels; IEEE Std 647)"
)


@dataclass(frozen=True)
class TriadPlan:
    """One triad at the stations of a plan: its input vectors, its noise as far as known, and the table's flaws."""

    triad: str
    unit: Unit
    stations: tuple[Station, ...]
    axes: tuple[tuple[float, float], ...]
    """(rate, acceleration) of the table's axes, for the time that moves take."""
    vectors: Array
    table: TableErrors
    matrix: Array
    """Best known K: of the current calibration, else the identity (nominal outputs)."""
    calibrated: bool = False
    """True if K comes from a calibration, not from nominal outputs."""
    weighting: Weighting = "noise_and_table"

    scatters: dict[float, "Scatter | None"] = field(default_factory=dict, compare=False, repr=False)
    """Scatter at other dwells than the planned one: several limits, and plans that differ in nothing else, share it."""

    def at_dwell(self, dwell_s: float | None = None) -> "AtDwell | None":
        """Noise and estimator at the planned or another dwell; None for unknown noise. Raises `Undetermined`."""
        if dwell_s is None:
            return self._planned
        noise = self.noise_covariance(dwell_s)
        return None if noise is None else AtDwell(noise, self.estimator(noise))

    @cached_property
    def _planned(self) -> "AtDwell | None":
        noise = self.noise_covariance()
        return None if noise is None else AtDwell(noise, self.estimator(noise))

    def scatter(self, dwell_s: float | None = None) -> "Scatter | None":
        """Scatter between calibrations at a dwell; None for unknown noise. Raises `Undetermined`."""
        if dwell_s is None:
            return self._scatter(None)
        if dwell_s not in self.scatters:
            if len(self.scatters) >= MOST_SCATTERS:
                self.scatters.clear()
            self.scatters[dwell_s] = self._scatter(dwell_s)
        return self.scatters[dwell_s]

    def _scatter(self, dwell_s: float | None) -> "Scatter | None":
        planned = self.at_dwell(dwell_s)
        if planned is None:
            return None
        gls = planned.estimator
        return Scatter(np.diagonal(gls.noise_covariance), self.share(gls).standard_uncertainty("pointing"))

    def noise_covariance(self, dwell_s: float | None = None) -> Array | None:
        """Covariance of the station means, (3, n, n), at the planned or another dwell; None for unknown noise."""
        return triad_covariance(self.unit.triad(self.triad), windows(self.stations, self.axes, dwell_s))

    def estimator(self, noise_covariance: Array) -> Estimator:
        """The generalised least squares of this plan. Raises `Undetermined`."""
        flaws = self._of_outputs if self.weighting == "noise_and_table" else None
        return estimator(f"the {self.triad} coefficients", self.vectors, noise_covariance, flaws)

    def share(self, plan: Estimator) -> TableShare:
        """Contribution of the table's flaws to the coefficients of this plan."""
        return table_share(plan, self._of_outputs, self.table, self.matrix)

    @cached_property
    def _of_outputs(self) -> Array:
        return self.table.of_outputs(self.matrix)


@dataclass(frozen=True)
class AtDwell:
    """A plan at one dwell: the covariance of the station means (3, n, n), and the estimator for it."""

    noise_covariance: Array
    estimator: Estimator


@dataclass(frozen=True)
class Scatter:
    """Change from one calibration to the next: variances by noise, standard uncertainties by pointing, each (12,)."""

    noise_variance: Array
    pointing: Array


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


def triad_plan(
    triad: str,
    unit: Unit,
    stations: Sequence[Station],
    axes: Sequence[tuple[float, float]],
    site: Site,
    uncertainty: TableUncertainty,
    weighting: Weighting = "noise_and_table",
) -> TriadPlan:
    """Plan of a triad at stations that all carry table angles."""
    angles = [s.angles for s in stations if s.angles is not None]
    vectors, table = _geometry(triad, tuple(angles), site, uncertainty)
    known = unit.known_matrix(triad)
    matrix = np.eye(3) if known is None else known
    moves = tuple((s.angles, s.settle_s, s.power_off_s) for s in stations)
    shared = _scatters(triad, unit.triad(triad), moves, tuple(axes), site, uncertainty, matrix.tobytes(), weighting)
    return TriadPlan(
        triad, unit, tuple(stations), tuple(axes), vectors, table, matrix, known is not None, weighting, shared
    )


@lru_cache(maxsize=64)
def _scatters(*_everything_but_dwells: object) -> dict[float, Scatter | None]:
    """Scatters by dwell, shared by plans that are otherwise the same: an answer is 200 bytes."""
    return {}


@lru_cache(maxsize=64)
def _geometry(
    triad: str, angles: tuple[TableAngles, ...], site: Site, uncertainty: TableUncertainty
) -> tuple[Array, TableErrors]:
    """Input vectors at the stations and the table's flaws there: the same for every dwell and every unit."""
    vectors = reference_vectors(triad, angles, site)
    return vectors, table_errors(angles, vectors, uncertainty, of_gravity=triad == "accelerometer")


def predicted_parts(plan: TriadPlan) -> tuple[Array, Array] | None:
    """Standard uncertainties of the twelve coefficients from noise and from the table, each (12,).

    None where the noise is not known. Raises `Undetermined`.
    """
    planned = plan.at_dwell()
    if planned is None:
        estimator(f"the {plan.triad} coefficients", plan.vectors, np.array([np.eye(len(plan.stations))] * 3))
        return None
    return _parts(plan, planned.estimator)


def parts_by_noise(plan: TriadPlan, noise_covariance: Array) -> tuple[Array, Array]:
    """`predicted_parts` for a known covariance of the station means (3, n, n). Raises `Undetermined`."""
    return _parts(plan, plan.estimator(noise_covariance))


def _parts(plan: TriadPlan, gls: Estimator) -> tuple[Array, Array]:
    return np.sqrt(np.diagonal(gls.noise_covariance)), np.sqrt(np.diagonal(plan.share(gls).covariance))


def basis(plans: Sequence[TriadPlan]) -> str:
    """Basis of a unit's predicted uncertainties: its calibration, or its nominal scale factors."""
    nominal = [plan.triad for plan in plans if not plan.calibrated]
    if len(nominal) == len(plans):
        return "nominal scale factors: the unit has no calibration yet; uncertainties scale with the true ones"
    calibration = plans[0].unit.calibration_in_words(*(plan.triad for plan in plans if plan.calibrated))
    of_others = "".join(
        f"; {triad}: nominal scale factors, uncertainties scale with the true ones" for triad in nominal
    )
    return calibration + of_others


def run_to_run_requirements(
    gyro_bias_deg_h: float,
    gyro_scale_ppm: float | None,
    accelerometer_bias_m_s2: float,
    accelerometer_scale_ppm: float,
) -> tuple[Requirement, ...]:
    """The limits on stability from launch to launch (thesis 4.3, 5.6); without that of the gyro scale where None."""
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


def in_run_unresolved(plan: TriadPlan, limit: float, display: str, display_size: float) -> str | None:
    """Warning where the noise of the dwells alone takes a per-axis figure δ/√3 (thesis 5.1) past its limit [SI]."""
    planned = plan.at_dwell()
    if planned is None:
        return None
    gradient = magnitude_gradient(plan.vectors, np.linalg.inv(plan.matrix))
    expected = predicted_sd(magnitude_covariance(gradient, planned.noise_covariance)) / float(np.sqrt(3.0))
    if expected <= limit:
        return None
    return (
        f"{plan.triad} bias in run: the limit of {limit / display_size:g} {display} cannot be resolved, the noise of "
        f"the dwells alone makes δ/√3 about {expected / display_size:.3g} {display}"
    )


IN_RUN_SOURCE = "thesis 4.3, 5.1"
IN_RUN_LEVEL = 0.001


def in_run_check(
    plan: TriadPlan, maximum: float | None, covariance: Array | None = None, level: float = IN_RUN_LEVEL
) -> PlannedCheck:
    """Planned check of the error per axis δ/√3 of n stations, its limit in the triad's unit of display.

    δ² is a mean square of the degrees of freedom of `effective_freedom`; its part of the measurement is what the noise
    of the dwells leaves, or errors of magnitude with the `covariance` (n, n) given. Without a maximum the limit is the
    plan's expanded uncertainty: what a sound unit exceeds with the probability `level`, ``k² = χ²_ν(1 − level)/ν``.
    (k = 2 would not do: where six coefficients that change between launches move all stations, ν is near 2 and one
    sound unit in fifty exceeds it.) Raises `BadParameter` where the uncertainty is not known.
    """
    display, size = units.DISPLAY[INPUT_UNITS[plan.triad]]
    name = f"{plan.triad} bias in run, δ/√3"
    planned = plan.at_dwell()
    if covariance is None and planned is not None:
        gradient = magnitude_gradient(plan.vectors, np.linalg.inv(plan.matrix))
        covariance = magnitude_covariance(gradient, planned.noise_covariance)
    floor = None if covariance is None else predicted_sd(covariance) / float(np.sqrt(3.0)) / size
    freedom = None if covariance is None else effective_freedom(covariance)
    own = None
    if maximum is not None:
        limit = Limit(display, maximum=maximum, source=IN_RUN_SOURCE)
    elif floor is not None and freedom is not None:
        factor, own = float(np.sqrt(chdtri(freedom, level) / freedom)), level
        source = f"expanded uncertainty of the plan, k = {factor:.3g} at a level of {level:g} (ν = {freedom:.2g})"
        limit = Limit(display, maximum=factor * floor, source=source)
    else:
        field = f"limits.{plan.triad}_bias_in_run_{'deg_h' if plan.triad == 'gyro' else 'm_s2'}"
        raise BadParameter(field, None, "a number: the noise is not known, so the plan has no uncertainty to take")
    return PlannedCheck(name, limit, floor, freedom, 0.0, own)


def _length(dwell_s: float) -> str:
    """Format a dwell in the unit that a person would plan it in."""
    hours = dwell_s / units.HOUR
    return f"{hours:.2g} h" if hours < 48.0 else f"{hours / 24.0:.0f} days"


def _alone(requirement: Requirement) -> str:
    return " by the Earth's rate alone" if requirement.triad == "gyro" else ""
