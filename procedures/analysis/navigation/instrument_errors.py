"""Residual errors of a parked unit after calibration: constant ones by source, and the noise of its channels."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from procedures.core.arrays import Array
from procedures.core.imu_model import TriadCalibration
from procedures.core.noise import NoiseCoefficients
from procedures.core.unit import TriadRecord

CALIBRATION = "calibration"
LAUNCH = "launch to launch"
GIVEN = "given"


@dataclass(frozen=True)
class TriadErrors:
    """Errors of one triad's corrected vector, in the unit's axes and SI."""

    constant: Mapping[str, Array]
    """Covariance of errors that are constant during a launch, by source, each (3, 3)."""
    noise: tuple[NoiseCoefficients, ...] = ()
    """Noise of the channels x, y, z; empty where it is not known."""
    of_channels: Array = field(default_factory=lambda: np.eye(3))
    """Error of the corrected vector per error of each channel: K⁻¹, shape (3, 3)."""
    uncalibrated: Array | None = None
    """Error of the nominal outputs, ``U − v = b + (K − 1)·v``, shape (3,); None where it is not known."""


def calibrated_triad(calibration: TriadCalibration, record: TriadRecord | None, vector_b: Array) -> TriadErrors:
    """Errors of ``v̂ = K⁻¹(U − b)`` at the constant input `vector_b` (3,).

    The calibration's own covariance P of the twelve coefficients: ``δv̂ = −K⁻¹·(δb + δK·v)``. The unit's change since:
    it was calibrated in one launch and navigates in another, each of which departs from the unit's mean by the
    run-to-run standard deviation, hence twice the variance; a scale factor carries its whole row of K. `record` None:
    noise and changes of the unit are not known, and left out.
    """
    matrix = calibration.matrix_array
    inverse = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    of_coefficients = np.kron(inverse, np.concatenate([[1.0], vector_b]))
    constant = {CALIBRATION: of_coefficients @ calibration.covariance_array @ of_coefficients.T}
    in_counts = calibration.output_unit == "count"
    if record is not None and not in_counts:
        launch = 2.0 * record.launch_covariance((matrix @ vector_b)[None])[:, 0, 0]
        if np.any(launch > 0.0):
            constant[LAUNCH] = inverse @ np.diag(launch) @ inverse.T
    noise = () if record is None else record.noise
    uncalibrated = None if in_counts else calibration.bias_array + (matrix - np.eye(3)) @ vector_b
    return TriadErrors(constant, noise, np.eye(3) if in_counts else inverse, uncalibrated)


def declared_triad(
    bias_sd: float, scale_sd: float, misalignment_sd_rad: float, noise: NoiseCoefficients, vector_b: Array
) -> TriadErrors:
    """Errors of a triad from declared standard uncertainties, equal and independent on all axes.

    ``var(δv_i) = σ_b² + (σ_s·v_i)² + Σ_{j≠i}(σ_m·v_j)²`` [SI].
    """
    square = vector_b**2
    variance = bias_sd**2 + scale_sd**2 * square + misalignment_sd_rad**2 * (square.sum() - square)
    return TriadErrors({GIVEN: np.diag(variance)}, (noise,) * 3)
