"""Magnitudes before and after correction: errors of a calibration at each orientation, and their prediction.

The magnitude of a corrected vector does not depend on where the table really stood, only on the unit and its
coefficients (thesis 5.4, 5.5; Tables 5.3, 5.4).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.magnitude import magnitude_covariance, magnitude_gradient
from procedures.core.arrays import Array
from procedures.core.imu_model import TriadCalibration, correct
from procedures.core.unit import TriadRecord


@dataclass(frozen=True)
class Magnitudes:
    """|v̂| at n stations before and after correction, with their means and spreads, in SI."""

    triad: str
    unit: str
    reference: float
    labels: tuple[str, ...]
    before: tuple[float, ...] | None
    """Magnitudes before correction; None where the outputs are in counts, which have none."""
    after: tuple[float, ...]
    expected_sd: tuple[float, ...]
    """Standard deviations of the errors after correction; empty where the noise is not known."""
    mean_error_before: float | None
    sd_before: float | None
    mean_error_after: float
    sd_after: float
    """Sample standard deviation over the stations, n − 1 (Tables 5.3, 5.4)."""
    per_axis: float
    """Error per axis ``δ/√3`` (thesis 5.1): one axis's share, all three taken as alike."""
    per_axis_sd: float
    """Standard uncertainty of that figure, ``δ/√(2(n − 1))/√3``: independent errors of n stations."""

    @property
    def errors(self) -> tuple[float, ...]:
        """|v̂| − reference after correction."""
        return tuple(value - self.reference for value in self.after)


def magnitudes(
    outputs: Array,
    calibration: TriadCalibration,
    reference: float,
    labels: Sequence[str],
    expected_sd: Array | None = None,
) -> Magnitudes:
    """Return the statistics of |U| and |K⁻¹(U − b)| over outputs (n, 3) against a reference magnitude [SI].
    `expected_sd` (n,): predicted standard deviation of each corrected magnitude, kept for the plots; None: not
    predicted.
    """
    after = np.linalg.norm(correct(outputs, calibration), axis=1)
    before = None if calibration.output_unit == "count" else np.linalg.norm(outputs, axis=1)
    sd_after = _sample_sd(after)
    return Magnitudes(
        calibration.triad,
        calibration.input_unit,
        reference,
        tuple(labels),
        None if before is None else tuple(before.tolist()),
        tuple(after.tolist()),
        () if expected_sd is None else tuple(expected_sd.tolist()),
        None if before is None else float(np.mean(before) - reference),
        None if before is None else _sample_sd(before),
        float(np.mean(after) - reference),
        sd_after,
        sd_after / float(np.sqrt(3.0)),
        sd_after / float(np.sqrt(3.0) * np.sqrt(2.0 * max(1, len(after) - 1))),
    )


def _sample_sd(values: Array) -> float:
    return float(np.std(values, ddof=1)) if len(values) > 1 else 0.0


def magnitude_sensitivity(vectors: Array, matrix: Array) -> tuple[Array, Array]:
    """Sensitivity of |v̂| to the outputs and the coefficients: ∂|v̂|/∂U (n, 3) and ∂|v̂|/∂(twelve) (n, 12).

    ``w = K⁻ᵀ·v/|v|``; an error of a coefficient of channel c acts as ``−w_c·[1 v_x v_y v_z]``.
    """
    weights = magnitude_gradient(vectors, np.linalg.inv(matrix))
    design = np.column_stack([np.ones(len(vectors)), vectors])
    return weights, -np.einsum("nc,na->nca", weights, design).reshape(len(vectors), 12)


def error_covariance(
    vectors: Array,
    calibration: TriadCalibration,
    noise_covariance: Array,
    record: TriadRecord | None,
) -> Array:
    """Covariance (n, n) [SI²] of the errors of |v̂| to expect when a unit is switched on again and verified.

    Three parts: the calibration's own covariance; the noise of the verification's dwells, `noise_covariance` (3, n, n);
    and the change of bias and scale factor between two launches by the unit's record, each of which departs from the
    unit's mean by the run-to-run standard deviation (hence twice the variance). `record` None: the unit's changes are
    not known, and left out.
    """
    matrix = calibration.matrix_array
    weights, of_coefficients = magnitude_sensitivity(vectors, matrix)
    outputs = noise_covariance
    if record is not None:
        outputs = outputs + 2.0 * record.launch_covariance(vectors @ matrix.T)
    of_calibration = of_coefficients @ calibration.covariance_array @ of_coefficients.T
    return of_calibration + magnitude_covariance(weights, outputs)


def predicted_sd(covariance: Array) -> float:
    """Root of the expected sample variance over stations for errors of zero mean and this covariance (n, n).

    ``E[s²] = (tr C − Σ C/n)/(n − 1)``.
    """
    n = len(covariance)
    return float(np.sqrt(max(0.0, (np.trace(covariance) - covariance.sum() / n) / (n - 1)))) if n > 1 else 0.0


def effective_freedom(covariance: Array) -> float:
    """Effective degrees of freedom of a sample variance over stations whose errors have this covariance (n, n).

    ``ν = (tr P)²/tr P²`` with P the covariance of the errors about their mean (Satterthwaite's, by the first two
    moments): n − 1 for equal independent errors, fewer where a few coefficients move all stations together.
    """
    n = len(covariance)
    centre = np.eye(n) - 1.0 / n
    about_mean = centre @ covariance @ centre
    squares = float(np.sum(about_mean**2))
    return float(np.trace(about_mean)) ** 2 / squares if squares > 0.0 else float(n - 1)
