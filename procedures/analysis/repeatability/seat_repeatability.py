"""Repeatability of cross-couplings over repeated mountings of a unit, from calibrations made under each mounting.

A unit that is mounted again sits at other small angles on its plate, and its calibration finds other cross-couplings
K_ij, i ≠ j: for a turn δ of the seat K' = K·(1 − [δ]×), so a pair changes by ±δ. Scale factors change in second order
only.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.repeatability.run_to_run import sd_interval
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration

PAIRS = ((0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1))


@dataclass(frozen=True)
class CrossCoupling:
    """Repeatability of one cross-coupling over n mountings, in radians."""

    triad: str
    name: str
    """Symbol of the coefficient: "K12", …"""
    mean: float
    """Mean of the mountings' means, relative to K_ii: an angle [rad]."""
    sd: float
    """Repeatability: sample standard deviation of the mountings' means, ``√(Σ(m − m̄)²/(n − 1))`` [rad]."""
    low: float
    """Lower end of the 95 % interval of the true standard deviation (chi-square, n − 1 degrees of freedom) [rad]."""
    high: float
    """Upper end of the 95 % interval of the true standard deviation (chi-square, n − 1 degrees of freedom) [rad]."""
    within_sd: float | None
    """Pooled standard deviation of repeated calibrations under the same mounting [rad]; None: none was repeated."""
    within_degrees: int
    """Degrees of freedom of `within_sd`."""
    expected_from_measurement: float
    """Standard deviation of the mountings' means that the calibrations' own uncertainties give [rad]."""
    values: tuple[float, ...]
    """Mean of each mounting [rad], in the order of the mountings."""

    @property
    def seat_sd(self) -> float:
        """Part of `sd` that measurement does not explain, ``√(max(0, sd² − expected²))`` [rad]."""
        return float(np.sqrt(max(0.0, self.sd**2 - self.expected_from_measurement**2)))


def seat_repeatability(by_mounting: Mapping[str, Sequence[TriadCalibration]]) -> tuple[CrossCoupling, ...]:
    """The six cross-couplings of one triad over at least two mountings.

    Each is ``K_ij/K_ii``: dimensionless, whatever the output's unit. Raises `BadParameter` for fewer mountings, and
    for calibrations of different triads, units or models: one of the scalar kind has axes of its own.
    """
    if len(by_mounting) < 2:
        raise BadParameter("calibrations", len(by_mounting), "calibrations under at least two mountings are needed")
    together = [c for group in by_mounting.values() for c in group]
    for attribute in ("triad", "output_unit", "input_unit", "model"):
        found = sorted({str(getattr(c, attribute)) for c in together})
        if len(found) > 1:
            raise BadParameter("calibrations", ", ".join(found), f"all must have the same {attribute}")
    groups = [_couplings(group) for group in by_mounting.values()]
    return tuple(_one(together[0].triad, number, groups) for number in range(len(PAIRS)))


def _couplings(group: Sequence[TriadCalibration]) -> tuple[Array, Array]:
    """Cross-couplings of calibrations and their variances, each (n, 6).

    The scale factor's own relative variance enters in second order (times the coupling squared) and is left out.
    """
    values, variances = [], []
    for calibration in group:
        matrix, variance = calibration.matrix_array, np.diagonal(calibration.covariance_array)
        values.append([matrix[i, j] / matrix[i, i] for i, j in PAIRS])
        variances.append([variance[4 * i + 1 + j] / matrix[i, i] ** 2 for i, j in PAIRS])
    return np.array(values), np.array(variances)


def _one(triad: str, number: int, groups: Sequence[tuple[Array, Array]]) -> CrossCoupling:
    values = [v[:, number] for v, _ in groups]
    means = np.array([float(np.mean(v)) for v in values])
    of_means = [float(np.mean(u[:, number])) / len(u) for _, u in groups]
    degrees = sum(len(v) - 1 for v in values)
    squares = sum(float(np.sum((v - np.mean(v)) ** 2)) for v in values)
    sd = float(np.std(means, ddof=1))
    i, j = PAIRS[number]
    return CrossCoupling(
        triad,
        f"K{i + 1}{j + 1}",
        float(np.mean(means)),
        sd,
        *sd_interval(sd, len(means)),
        float(np.sqrt(squares / degrees)) if degrees else None,
        degrees,
        float(np.sqrt(np.mean(of_means))),
        tuple(means.tolist()),
    )
