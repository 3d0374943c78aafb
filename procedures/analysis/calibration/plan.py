"""Prediction of a calibration: the uncertainty of every coefficient."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg import block_diag

from procedures.analysis.calibration.estimator import Estimator, TableShare, Weighting, estimator, table_share
from procedures.analysis.calibration.magnitude import in_sample_gain, magnitude_gradient
from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.station_plan import windows
from procedures.analysis.calibration.table_errors import TableErrors, TableUncertainty, table_errors
from procedures.core.arrays import Array
from procedures.core.recording import Station
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.unit import Unit

MOST_SCATTERS = 1000
"""Dwells of one plan whose scatter is kept."""


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
        """Return noise and estimator at the planned or another dwell [s]; None for unknown noise. Raises
        `Undetermined`.
        """
        if dwell_s is None:
            return self._planned
        noise = self.noise_covariance(dwell_s)
        return None if noise is None else AtDwell(noise, self.estimator(noise))

    @cached_property
    def _planned(self) -> "AtDwell | None":
        noise = self.noise_covariance()
        return None if noise is None else AtDwell(noise, self.estimator(noise))

    def scatter(self, dwell_s: float | None = None) -> "Scatter | None":
        """Return the scatter between calibrations at a dwell [s]; None for unknown noise. Raises `Undetermined`."""
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
        """Return the covariance of the station means, (3, n, n), at the planned or another dwell; None for unknown
        noise.
        """
        return triad_covariance(self.unit.triad(self.triad), windows(self.stations, self.axes, dwell_s))

    def estimator(self, noise_covariance: Array) -> Estimator:
        """Return the generalised least squares of this plan. Raises `Undetermined`."""
        flaws = self._of_outputs if self.weighting == "noise_and_table" else None
        return estimator(f"the {self.triad} coefficients", self.vectors, noise_covariance, flaws)

    def share(self, plan: Estimator) -> TableShare:
        """Return the contribution of the table's flaws to the coefficients of this plan."""
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


def triad_plan(
    triad: str,
    unit: Unit,
    stations: Sequence[Station],
    axes: Sequence[tuple[float, float]],
    site: Site,
    uncertainty: TableUncertainty,
    weighting: Weighting = "noise_and_table",
) -> TriadPlan:
    """Return the plan of a triad at stations that all carry table angles."""
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
    """Return `predicted_parts` for a known covariance of the station means (3, n, n). Raises `Undetermined`."""
    return _parts(plan, plan.estimator(noise_covariance))


def _parts(plan: TriadPlan, gls: Estimator) -> tuple[Array, Array]:
    return np.sqrt(np.diagonal(gls.noise_covariance)), np.sqrt(np.diagonal(plan.share(gls).covariance))


def in_sample_covariance(plan: TriadPlan) -> Array | None:
    """Covariance (n, n) of |v̂| − |v| at the stations of a planned calibration itself; None for unknown noise.

    Noise and the table's flaws, less what the calibration takes from them. Raises `Undetermined`.
    """
    planned = plan.at_dwell()
    if planned is None:
        return None
    n = len(plan.vectors)
    gradient = magnitude_gradient(plan.vectors, np.linalg.inv(plan.matrix))
    along = in_sample_gain(gradient, planned.estimator.remaining())
    flaws = along @ plan.table.of_outputs(plan.matrix).transpose(1, 0, 2).reshape(3 * n, -1)
    return along @ block_diag(*planned.noise_covariance) @ along.T + flaws @ flaws.T


def basis(plans: Sequence[TriadPlan]) -> str:
    """Return the sentence on what a unit's predicted uncertainties rest on: its calibration, or its nominal scale
    factors.
    """
    nominal = [plan.triad for plan in plans if not plan.calibrated]
    if len(nominal) == len(plans):
        return "nominal scale factors: the unit has no calibration yet; uncertainties scale with the true ones"
    calibration = plans[0].unit.calibration_in_words(*(plan.triad for plan in plans if plan.calibrated))
    of_others = "".join(
        f"; {triad}: nominal scale factors, uncertainties scale with the true ones" for triad in nominal
    )
    return calibration + of_others
