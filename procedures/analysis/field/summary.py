"""Results of a field calibration of one triad, as plain JSON-ready numbers."""

from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.reference import INPUT_UNITS
from procedures.analysis.field.examined import FittedTriad
from procedures.core.imu_model import TriadCalibration


@dataclass(frozen=True)
class FieldTriad:
    """Bias and scale of one triad with standard uncertainties, and the tilt of the base by this triad."""

    calibration: TriadCalibration
    bias: tuple[float, ...]
    bias_sd: tuple[float, ...]
    scale: tuple[float, ...]
    scale_relative_sd: tuple[float, ...]
    scale_estimated: bool
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    residuals: tuple[tuple[float, ...], ...]
    """Per recording, in the output's unit."""
    misfit: float | None = None
    """Residuals over what noise and declared uncertainties allow; None where no equation is spare."""
    worst: str = ""
    """Position and channel with the greatest residual."""
    suspected: str = ""
    """A mistake in the positions that would explain a misfit."""


def field_summary(fitted: FittedTriad, cross_coupling_sd: float, estimated: bool) -> FieldTriad:
    """Return the numbers of a fit, ready to be stored; `estimated` where the scale factor was."""
    fit, means = fitted.fit, fitted.means
    triad = means.triad
    return FieldTriad(
        fit.calibration(triad, means.output_unit, INPUT_UNITS[triad], cross_coupling_sd),
        tuple(fit.bias.tolist()),
        tuple(np.sqrt(np.diagonal(fit.covariance)[:3]).tolist()),
        tuple(fit.scale.tolist()),
        tuple(fit.scale_relative_sd.tolist()),
        estimated,
        fit.chi_square,
        fit.degrees_of_freedom,
        fit.p_value,
        tuple(tuple(row) for row in fit.residuals.tolist()),
        fitted.misfit.ratio,
        fitted.misfit.worst,
        fitted.suspected,
    )
