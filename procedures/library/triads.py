"""Bias and matrix of a triad from poses: against known vectors, or against the magnitude alone."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from procedures.analysis.calibration.multiposition import fit_triad
from procedures.analysis.calibration.scalar import fit_scalar, start_from_data
from procedures.analysis.calibration.table_errors import TableErrors
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration, correct
from procedures.library.arguments import Samples, positive, vectors
from procedures.library.figure import axes

SHARE_OF_RANGE = 1e-9
"""First estimate of unknown noise, relative to the largest output: far too small, so that the residuals scale it up."""


@dataclass(frozen=True)
class Calibration:
    """Coefficients of ``U = b + K·v`` with their covariance, and how well the poses agree with them."""

    triad: TriadCalibration
    residuals: Array
    """Outputs minus model, (n, 3); of a scalar calibration magnitude minus reference, (n,)."""
    residual_sd: Array
    """Expected standard deviations of the residuals, of their shape."""
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    """Chance of a chi-square at least as large; None: the noise was not given, so nothing can be judged."""

    @property
    def bias(self) -> Array:
        """Bias b in the unit of the outputs, (3,)."""
        return self.triad.bias_array

    @property
    def matrix(self) -> Array:
        """Matrix K, output per input, (3, 3)."""
        return self.triad.matrix_array

    @property
    def sd(self) -> dict[str, float]:
        """Standard uncertainty of each coefficient by name (b_x, K11, …); zero: fixed by the method."""
        return dict(zip(COEFFICIENT_NAMES, self.triad.standard_uncertainties.tolist(), strict=True))

    def correct(self, outputs: Samples) -> Array:
        """Return ``v̂ = K⁻¹(U − b)`` of outputs (n, 3), in the unit of the inputs. Raises `BadParameter`."""
        return correct(vectors("outputs", outputs), self.triad)

    def __str__(self) -> str:
        pairs = zip(COEFFICIENT_NAMES, self.triad.coefficients, self.triad.standard_uncertainties, strict=True)
        fit = f"χ² {self.chi_square:.3g} of {self.degrees_of_freedom}"
        judged = "noise not given: not judged" if self.p_value is None else f"p = {self.p_value:.2g}"
        return "\n".join([*(f"{name} {value:.9g} ± {sd:.2g}" for name, value, sd in pairs), f"{fit}, {judged}"])

    def plot(self, ax: Any = None) -> Any:
        """Draw the residuals by pose with their expected standard deviations; returns the axes."""
        ax = axes(ax)
        residuals, sd = np.atleast_2d(self.residuals.T), np.atleast_2d(self.residual_sd.T)
        labels = ("x", "y", "z") if len(residuals) == 3 else ("magnitude",)
        for row, expected, label in zip(residuals, sd, labels, strict=True):
            ax.errorbar(np.arange(len(row)), row, yerr=expected, fmt="o", label=label, capsize=2)
        ax.set_xlabel("pose")
        ax.set_ylabel("residual")
        ax.legend()
        return ax


def calibrate(
    outputs: Samples, known: Samples, sd: Samples | None = None, *, triad: str = "accelerometer"
) -> Calibration:
    """Least squares of twelve coefficients, ``U = b + K·v``, at poses with known vectors (thesis 3.31, 3.35).

    Parameters
    ----------
    outputs : (n, 3) means of the outputs, any unit. known : (n, 3) specific force or angular rate in the triad's axes
    [SI], n ≥ 4 and not in a plane. sd : standard deviation of a mean in the unit of the outputs, one number, (3,) by
    channel or (n, 3); None takes it from the residuals, and then nothing is judged. triad : names the input's unit.

    Uncertainties are of this noise alone: vectors that are wrong, by a table or a level, are the caller's. Raises
    `BadParameter`, `Undetermined`.
    """
    measured, given = vectors("outputs", outputs), vectors("known", known)
    if len(measured) != len(given):
        raise BadParameter("known", f"{len(given)} vectors", f"as many as there are poses, {len(measured)}")
    if len(measured) == 4 and sd is None:
        raise BadParameter("sd", None, "the standard deviation of the means: four poses leave no residual to find it")
    noise = _noise(sd, measured)
    flawless = TableErrors(np.zeros((len(given), 3, 0)), np.zeros(0), ())
    fit = fit_triad(triad, "count", _input_unit(triad), given, measured, noise, flawless, sd is not None, "noise")
    return Calibration(
        fit.calibration(), fit.residuals, fit.residual_sd, fit.chi_square, fit.degrees_of_freedom, fit.p_value
    )


def scalar(
    outputs: Samples, magnitude: float, sd: Samples | None = None, *, triad: str = "accelerometer"
) -> Calibration:
    """Nine parameters from poses at which only the magnitude of the vector is known (thesis 3.21-3.24).

    K comes out upper triangular: a common turn of all axes leaves every magnitude as it is. `outputs` and `sd` as in
    `calibrate`, n ≥ 9; magnitude : of gravity or of a rate [SI]. Raises `BadParameter`, `Undetermined`.
    """
    measured = vectors("outputs", outputs)
    if len(measured) == 9 and sd is None:
        raise BadParameter("sd", None, "the standard deviation of the means: nine poses leave no residual to find it")
    reference = positive("magnitude", magnitude)
    what = f"the nine scalar {triad} parameters"
    start = start_from_data(measured, reference)
    unit = _input_unit(triad)
    fit = fit_scalar(what, measured, _noise(sd, measured), reference, start, sd is not None)
    return Calibration(
        fit.calibration(triad, "count", unit),
        fit.residuals,
        fit.residual_sd,
        fit.chi_square,
        fit.degrees_of_freedom,
        fit.p_value,
    )


def _input_unit(triad: str) -> str:
    units = {"accelerometer": "m/s^2", "gyro": "rad/s"}
    if triad not in units:
        raise BadParameter("triad", triad, f"one of {', '.join(units)}")
    return units[triad]


def _noise(sd: Samples | None, outputs: Array) -> Array:
    """Covariance of the means by channel, (3, n, n). Raises `BadParameter`."""
    if sd is None:
        size = SHARE_OF_RANGE * float(np.abs(outputs).max())
        return np.stack([np.eye(len(outputs)) * size**2] * 3)
    try:
        each = np.broadcast_to(np.asarray(sd, dtype=np.float64), outputs.shape)
    except (TypeError, ValueError) as error:
        raise BadParameter("sd", sd, "one number, one for each channel (3,), or one for each output (n, 3)") from error
    if not (np.all(np.isfinite(each)) and np.all(each > 0.0)):
        raise BadParameter("sd", sd, "finite numbers above zero")
    return np.stack([np.diag(column**2) for column in each.T])
