"""Bias and matrix of a triad from poses: against known vectors, or against the magnitude alone."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from procedures.analysis.calibration.misfit import require_live, require_plausible_scales
from procedures.analysis.calibration.multiposition import fit_triad
from procedures.analysis.calibration.scalar import PARAMETERS, fit_from_starts, starts_from_data
from procedures.analysis.calibration.table_errors import TableErrors
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, Undetermined
from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration, correct
from procedures.library.arguments import Samples, positive, vectors
from procedures.library.figure import axes

SHARE_OF_RANGE = 1e-9
"""First estimate of unknown noise, relative to the largest output: far too small, so that the residuals scale it up."""

LEAST_TO_JUDGE = 5
"""Fewest poses from which a channel that hardly changes is refused: fewer need not turn every axis."""
OPEN = 0.01
"""Standard uncertainty, relative to full scale, from which on a coefficient is left open by the poses."""
NOT_LINEAR = 0.05
"""The same from which on the magnitudes' linear uncertainties do not hold: poses on one side leave a long valley."""
OWN_SHARE = 0.5
"""Least share of a channel's answer that its own axis has."""
UNLIKELY = 1e-4
"""Probability of a chi-square as large, below which a misfit is reported."""


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
    warnings: tuple[str, ...] = ()
    """Sentences on a bad fit, on coefficients that the poses leave open, and on a channel that is reversed."""

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
        lines = [*(f"{name} {value:.9g} ± {sd:.2g}" for name, value, sd in pairs), f"{fit}, {judged}"]
        return "\n".join([*lines, *(f"warning: {sentence}" for sentence in self.warnings)])

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
    if len(measured) >= LEAST_TO_JUDGE and np.all(np.ptp(given, axis=0) > 0.0):
        require_live(triad, measured, "of the output", given)
    noise = _noise(sd, measured)
    flawless = TableErrors(np.zeros((len(given), 3, 0)), np.zeros(0), ())
    fit = fit_triad(triad, "count", _input_unit(triad), given, measured, noise, flawless, sd is not None, "noise")
    calibration = fit.calibration()
    chi_square, degrees = fit.chi_square, fit.degrees_of_freedom
    largest = float(np.abs(given).max())
    warnings = _warnings(calibration, fit.residuals, largest, fit.p_value, chi_square, degrees)
    return Calibration(calibration, fit.residuals, fit.residual_sd, chi_square, degrees, fit.p_value, warnings)


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
    unit = _input_unit(triad)
    if len(measured) >= LEAST_TO_JUDGE:
        require_live(triad, measured, "of the output")
    starts = starts_from_data(measured, reference)
    fit = fit_from_starts(what, measured, _noise(sd, measured), reference, starts, sd is not None)
    calibration = fit.calibration(triad, "count", unit)
    lost = _left_open(calibration, reference, NOT_LINEAR)
    if lost:
        raise Undetermined(what, lost, len(PARAMETERS) - len(lost), len(PARAMETERS), fit.condition)
    require_plausible_scales(triad, np.diagonal(calibration.matrix_array), nominal=False)
    chi_square, degrees = fit.chi_square, fit.degrees_of_freedom
    warnings = _warnings(calibration, fit.residuals, reference, fit.p_value, chi_square, degrees)
    return Calibration(calibration, fit.residuals, fit.residual_sd, chi_square, degrees, fit.p_value, warnings)


def _warnings(
    calibration: TriadCalibration,
    residuals: Array,
    size: float,
    p_value: float | None,
    chi_square: float,
    degrees: int,
) -> tuple[str, ...]:
    """Sentences on a fit of inputs up to `size` [SI]: coefficients left open, a channel on another axis, a misfit."""
    found: list[str] = []
    matrix = calibration.matrix_array
    for axis, row, own in zip("xyz", matrix, np.diagonal(matrix).tolist(), strict=True):
        if own < OWN_SHARE * float(np.linalg.norm(row)):
            found.append(
                f"channel {axis} answers its own axis with {own:.4g} of {np.linalg.norm(row):.4g}: it is reversed, or "
                "exchanged with another, or the poses are not those that are given"
            )
    left_open = _left_open(calibration, size, OPEN)
    if left_open:
        found.append(f"practically undetermined by these poses: {', '.join(left_open)}")
    worst = int(np.argmax(np.abs(residuals).reshape(len(residuals), -1).max(axis=1)))
    if p_value is not None and p_value < UNLIKELY:
        found.append(
            f"the poses do not fit: chi-square is {chi_square:.3g} where {degrees} is expected, so the uncertainties "
            f"above do not hold; the worst is pose {worst + 1}: was it clipped, moved, or given another vector?"
        )
    return tuple(found)


def _left_open(calibration: TriadCalibration, size: float, limit: float) -> tuple[str, ...]:
    """The coefficients whose standard uncertainty exceeds the limit, relative to the channel's full scale."""
    sd = calibration.standard_uncertainties.reshape(3, 4)
    full = np.linalg.norm(calibration.matrix_array, axis=1)[:, None]
    relative = (sd / np.concatenate([full * size, full, full, full], axis=1)).ravel()
    pairs = zip(COEFFICIENT_NAMES, relative.tolist(), strict=True)
    return tuple(f"{name} (± {value:.2g} of full scale)" for name, value in pairs if value > limit)


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
