"""Verification of the calibration in use from recordings: magnitudes, whether they are as predicted, and what moved."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.diagnosis import TriadDiagnosis, diagnose, residual_covariance
from procedures.analysis.calibration.plan import TriadPlan
from procedures.analysis.calibration.reference import reference_magnitude, reference_vectors
from procedures.analysis.calibration.reference_temperature import (
    bring_to_reference,
    gyros_at_reference,
    thermal_warnings,
)
from procedures.analysis.calibration.station_means import StationMeans, require_unit_of, station_means
from procedures.analysis.calibration.station_noise import outputs_covariance
from procedures.analysis.calibration.table_errors import TableUncertainty, table_errors
from procedures.analysis.calibration.verification import Magnitudes, error_covariance, magnitudes
from procedures.analysis.least_squares.chi_square import chi_square, tail_probability
from procedures.core.arrays import Array
from procedures.core.imu_model import TriadCalibration
from procedures.core.recording import Recording
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.temperature.gyros import GyroThermalCorrection
from procedures.core.thermal_correction import ThermalCorrection
from procedures.core.unit import Unit


@dataclass(frozen=True)
class TriadVerification:
    """Verification result of one triad: magnitudes, their test against the prediction, and the diagnosis."""

    magnitudes: Magnitudes
    chi_square: float | None
    """Chi-square of the errors after correction against their predicted covariance; None for unknown noise."""
    p_value: float | None
    run_to_run_known: bool
    """False where the unit's record has no change from launch to launch: then the prediction holds in one launch
    only.
    """
    diagnosis: TriadDiagnosis | None = None
    not_diagnosed: str = ""
    """Reason why there is no diagnosis; empty where there is one."""


def calibration_of(unit: Unit, triad: str) -> TriadCalibration:
    """Return the unit's current calibration of a triad, which is verified. Raises `DomainError` without one."""
    return unit.required_calibration(triad, "verify")


def planned_covariance(plan: TriadPlan) -> Array | None:
    """Return the covariance (n, n) of the errors to expect from a plan, or None where the noise is not known."""
    noise = plan.noise_covariance()
    calibration = calibration_of(plan.unit, plan.triad)
    record = plan.unit.triad(plan.triad)
    return None if noise is None else error_covariance(plan.vectors, calibration, noise, record)


def planned_diagnosis(plan: TriadPlan, site: Site, uncertainty: TableUncertainty) -> TriadDiagnosis | None:
    """Return the diagnosis of a plan whose residuals are all zero: what it could find; None where the noise is not
    known.
    """
    noise, calibration = plan.noise_covariance(), calibration_of(plan.unit, plan.triad)
    if noise is None or calibration.model == "scalar" or calibration.output_unit == "count":
        return None
    angles = [s.angles for s in plan.stations if s.angles is not None]
    outputs = calibration.bias_array + plan.vectors @ calibration.matrix_array.T
    return _diagnosed(outputs, angles, calibration, noise, plan.unit, site, uncertainty)


def verify_triad(
    recordings: Sequence[Recording],
    triad: str,
    site: Site,
    unit: Unit,
    uncertainty: TableUncertainty = TableUncertainty(),
) -> TriadVerification:
    """Correct the station means with the unit's calibration, judge the magnitudes and diagnose the residual vectors.

    `uncertainty` of table and site concerns the diagnosis alone: magnitudes do not depend on attitudes. Raises
    `UnfitRecording` where the recordings' unit is not the calibration's.
    """
    return _verified(station_means(recordings, triad), site, unit, uncertainty)


def verify_gyros(
    recordings: Sequence[Recording],
    site: Site,
    unit: Unit,
    uncertainty: TableUncertainty = TableUncertainty(),
    correction: GyroThermalCorrection | None = None,
) -> TriadVerification:
    """Return the verification of the gyros by the unit's calibration. Raises as `verify_triad`.

    `correction`: takes temperature out of the station means beforehand; None: they are taken as they are.
    """
    means, more = station_means(recordings, "gyro"), None
    if correction is not None:
        means, more = gyros_at_reference(recordings, means, correction)
    return _verified(means, site, unit, uncertainty, more)


def verify_at_reference(
    recordings: Sequence[Recording],
    site: Site,
    unit: Unit,
    correction: ThermalCorrection,
    lag_s: tuple[float, float],
    uncertainty: TableUncertainty = TableUncertainty(),
) -> tuple[TriadVerification, tuple[str, ...]]:
    """Verify the accelerometers with their means brought to the reference temperatures, and warn of that step's doubts.

    The correction's covariance counts in full beside the calibration's own, though both may rest on one correction: at
    like temperatures its errors cancel, and the prediction is then too wide. Raises as `verify_triad` and
    `bring_to_reference`.
    """
    brought = bring_to_reference(recordings, station_means(recordings, "accelerometer"), correction, lag_s)
    return _verified(brought.means, site, unit, uncertainty, brought.covariance), thermal_warnings(brought)


def _verified(
    means: StationMeans, site: Site, unit: Unit, uncertainty: TableUncertainty, more: Array | None = None
) -> TriadVerification:
    """Verify one triad from its station means; `more` is their covariance from causes other than noise, (3, n, n)."""
    triad = means.triad
    calibration = calibration_of(unit, triad)
    require_unit_of(calibration, means)
    angles = [a for a in means.angles if a is not None]
    record = unit.triad(triad)
    noise = outputs_covariance(record, means.output_unit, means.windows)
    reference = reference_magnitude(triad, site)
    if noise is None or len(angles) < len(means.angles):
        found = magnitudes(means.outputs, calibration, reference, means.labels)
        why = "the noise of its channels is not known" if noise is None else "a station has no table angles"
        return TriadVerification(found, None, None, False, None, f"{triad}: not diagnosed, {why}.")
    noise = noise if more is None else noise + more
    covariance = error_covariance(reference_vectors(triad, angles, site), calibration, noise, record)
    found = magnitudes(means.outputs, calibration, reference, means.labels, np.sqrt(np.diagonal(covariance)))
    statistic = chi_square(np.array(found.errors), covariance)
    known = record is not None and record.bias_run_to_run_sd > 0.0
    p_value = tail_probability(statistic, len(found.errors))
    if calibration.model == "scalar":
        why = f"{triad}: not diagnosed, a scalar calibration has axes of its own and not the table's."
        return TriadVerification(found, statistic, p_value, known, None, why)
    made = _diagnosed(means.outputs, angles, calibration, noise, unit, site, uncertainty)
    return TriadVerification(found, statistic, p_value, known, made)


def _diagnosed(
    outputs: Array,
    angles: Sequence[TableAngles],
    calibration: TriadCalibration,
    noise: Array,
    unit: Unit,
    site: Site,
    uncertainty: TableUncertainty,
) -> TriadDiagnosis:
    """Diagnosis of a triad at known table angles and of known noise (3, n, n)."""
    triad, record = calibration.triad, unit.triad(calibration.triad)
    vectors = reference_vectors(triad, angles, site)
    table = table_errors(angles, vectors, uncertainty, of_gravity=triad == "accelerometer")
    launch = None if record is None else 2.0 * record.launch_covariance(vectors @ calibration.matrix_array.T)
    covariance = residual_covariance(calibration, vectors, noise, launch, table)
    return diagnose(calibration, outputs, vectors, covariance, table)
