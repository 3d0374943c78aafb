"""Coefficients of a triad after each station, from the stations recorded so far and a weak prior."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from procedures.analysis.calibration.reference import INPUT_UNITS, reference_vectors
from procedures.analysis.calibration.station_means import StationMeans
from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.table_errors import TableUncertainty, table_errors
from procedures.analysis.calibration.triad_analysis import station_angles
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.site import Site
from procedures.core.unit import TriadRecord

BIAS_PRIOR = {"gyro": np.radians(1.0), "accelerometer": 1.0}
"""Standard deviation of a bias before the first station [rad/s, m/s²]; a nominal bias is zero."""
MATRIX_PRIOR = 0.5
"""Standard deviation of each element of K before the first station; nominally K is the unit matrix."""
DETERMINED = 0.1
"""Part of the prior's standard deviation below which the stations, and not the prior, give a coefficient."""
PASSES = 2
"""Passes over the stations: the first takes K as nominal where the table's flaws act through it."""


@dataclass(frozen=True)
class CoefficientsSoFar:
    """The twelve coefficients after the first station, the second, …; one row a station, in their order."""

    triad: str
    output_unit: str
    values: Array
    """Shape (n, 12), in the order of `COEFFICIENT_NAMES`."""
    standard_uncertainties: Array
    """Standard deviations by noise, the table's declared flaws and the prior; shape (n, 12)."""
    determined: tuple[tuple[bool, ...], ...]
    """True where the uncertainty is less than `DETERMINED` of the prior's; shape (n, 12)."""
    noise_known: bool
    """True where the noise of the means is the unit's; False: taken from the scatter within the dwells."""


def coefficients_so_far(
    means: StationMeans, site: Site, record: TriadRecord | None, table: TableUncertainty
) -> CoefficientsSoFar:
    """Estimate ``U = b + K·v`` by generalised least squares with a prior, again after each station.

    ``x̂ = (AᵀS⁻¹A + P⁻¹)⁻¹(AᵀS⁻¹U + P⁻¹x₀)`` for each channel by itself, with ``S = C + F·Fᵀ``: C the covariance of the
    means from the unit's noise, or of their scatter, F the table's declared flaws through the K of a first pass, and P
    the prior. The result weighs the channels together, so its uncertainties are smaller or equal. Raises
    `UnfitRecording` for raw counts, which have no nominal scale, for stations without angles, and for a channel without
    scatter where the noise is not known.
    """
    if means.output_unit != INPUT_UNITS[means.triad]:
        raise UnfitRecording(f"the {means.triad} is in {means.output_unit}: its coefficients are known after the last")
    angles = station_angles(means)
    covariance = triad_covariance(record, means.windows)
    known = covariance is not None
    if covariance is None:
        if not np.all(means.mean_sd > 0.0):
            raise UnfitRecording("a channel has no scatter, and its noise is not known")
        covariance = np.array([np.diag(sd**2) for sd in means.mean_sd.T])
    vectors = reference_vectors(means.triad, angles, site)
    flaws = table_errors(angles, vectors, table, of_gravity=means.triad == "accelerometer")
    design = np.column_stack([np.ones(len(angles)), vectors])
    prior_sd = np.array([BIAS_PRIOR[means.triad], MATRIX_PRIOR, MATRIX_PRIOR, MATRIX_PRIOR])
    values, sd = np.empty((len(design), 3, 4)), np.empty((len(design), 3, 4))
    for n in range(1, len(design) + 1):
        matrix = np.eye(3)
        for _ in range(PASSES):  # the flaws act through K, which is not nominal
            of_table = flaws.of_outputs(matrix)[:n]
            for channel in range(3):
                whole = covariance[channel, :n, :n] + of_table[:, channel] @ of_table[:, channel].T
                nominal = np.concatenate([[0.0], np.eye(3)[channel]])
                given = design[:n], means.outputs[:n, channel], whole, nominal, prior_sd
                values[n - 1, channel], sd[n - 1, channel] = _estimate(*given)
            matrix = values[n - 1, :, 1:].copy()
    determined = sd < DETERMINED * prior_sd
    flat = (len(design), 12)
    rows = tuple(tuple(bool(one) for one in row) for row in determined.reshape(flat))
    return CoefficientsSoFar(means.triad, means.output_unit, values.reshape(flat), sd.reshape(flat), rows, known)


def _estimate(design: Array, outputs: Array, covariance: Array, nominal: Array, prior_sd: Array) -> tuple[Array, Array]:
    """Estimate (4,) of one channel with standard uncertainties, with columns scaled by the prior's deviations."""
    scaled = design * prior_sd
    weighted = cho_solve(cho_factor(covariance), np.column_stack([scaled, outputs - design @ nominal]))
    information = scaled.T @ weighted[:, :4] + np.eye(4)
    inverse = np.linalg.inv(information)
    return nominal + prior_sd * (inverse @ (scaled.T @ weighted[:, 4])), prior_sd * np.sqrt(np.diagonal(inverse))
