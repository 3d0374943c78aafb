"""From a verification's recordings to what the calibration in use is worth: magnitudes, and whether they are as
predicted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.plan import TriadPlan
from procedures.analysis.calibration.reference import reference_magnitude, reference_vectors
from procedures.analysis.calibration.station_means import station_means
from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.verification import Magnitudes, chi_square_p, error_covariance, magnitudes
from procedures.core.arrays import Array
from procedures.core.errors import DomainError, UnfitRecording
from procedures.core.imu_model import TriadCalibration
from procedures.core.recording import Recording
from procedures.core.site import Site
from procedures.core.unit import Unit


@dataclass(frozen=True)
class TriadVerification:
    """One triad's verification, JSON-ready."""

    magnitudes: Magnitudes
    chi_square: float | None
    """Of the errors after correction against their predicted covariance; None where the noise is not known."""
    p_value: float | None
    run_to_run_known: bool
    """False where the unit's record has no change from launch to launch: then the prediction holds in one launch
    only.
    """


def calibration_of(unit: Unit, triad: str) -> TriadCalibration:
    """The unit's current calibration of a triad, or a refusal that says what to do."""
    calibration = unit.calibration(triad)
    if calibration is None:
        raise DomainError(f"unit {unit.serial} has no calibration of its {triad} triad to verify: calibrate it first")
    return calibration


def expected_covariance(vectors: Array, calibration: TriadCalibration, noise_covariance: Array, unit: Unit) -> Array:
    """`error_covariance` with the launch-to-launch changes of the unit's record, shape (n, n) [SI²]."""
    record = unit.triad(calibration.triad)
    bias_sd = 0.0 if record is None else record.bias_run_to_run_sd
    scale_sd = 0.0 if record is None else record.scale_factor_run_to_run_sd
    return error_covariance(vectors, calibration, noise_covariance, bias_sd, scale_sd)


def planned_covariance(plan: TriadPlan) -> Array | None:
    """Covariance (n, n) of the errors to expect from a plan, or None where the noise is not known."""
    noise = plan.noise_covariance()
    calibration = calibration_of(plan.unit, plan.triad)
    return None if noise is None else expected_covariance(plan.vectors, calibration, noise, plan.unit)


def verify_triad(recordings: Sequence[Recording], triad: str, site: Site, unit: Unit) -> TriadVerification:
    """Correct the station means with the unit's calibration and judge the magnitudes.

    Raises `UnfitRecording` where the recordings' unit is not the calibration's, or a station carries no angles.
    """
    calibration = calibration_of(unit, triad)
    means = station_means(recordings, triad)
    if means.output_unit != calibration.output_unit:
        raise UnfitRecording(
            f"the {triad} channels are in {means.output_unit}, the calibration is for {calibration.output_unit}"
        )
    angles = [a for a in means.angles if a is not None]
    noise = None if means.output_unit == "count" else triad_covariance(unit.triad(triad), means.windows)
    reference = reference_magnitude(triad, site)
    if noise is None or len(angles) < len(means.angles):
        return TriadVerification(magnitudes(means.outputs, calibration, reference, means.labels), None, None, False)
    covariance = expected_covariance(reference_vectors(triad, angles, site), calibration, noise, unit)
    found = magnitudes(means.outputs, calibration, reference, means.labels, np.sqrt(np.diagonal(covariance)))
    statistic, p_value = chi_square_p(np.array(found.errors), covariance)
    record = unit.triad(triad)
    known = record is not None and record.bias_run_to_run_sd > 0.0
    return TriadVerification(found, statistic, p_value, known)
