"""Bias and scale of a triad from a few positions: least squares with all uncertainties of the positions.

The model is ``U_i = b_i + k_i·v_i`` per channel (paper F 8, 42): cross-couplings are neglected, so their declared
spread is a part of the uncertainty, as are the angles set by hand, the level, the heading and gravity. Weights are
those of noise and flaws together, ``S = C + F·Fᵀ``; two positions without tilt are paper F 11-14 and 45-48 exactly,
which have no weights.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from procedures.analysis.field.positions import Tilt, field_vectors, of_azimuth, of_settings, of_tilt
from procedures.analysis.least_squares.chi_square import judged_p_value, residual_factor
from procedures.analysis.least_squares.determination import require_full_rank
from procedures.analysis.least_squares.inverse import scaled_pinv
from procedures.analysis.least_squares.whitening import whitener
from procedures.core.arrays import Array
from procedures.core.errors import Undetermined
from procedures.core.imu_model import TriadCalibration, triad_calibration

_PASSES = 12
"""Gauss-Newton steps at the most; a tilt of 10° settles to rounding in six."""
_SETTLED = 1e-12
"""Relative step of the unknowns [rad, relative, magnitude] at which the iteration ends."""


@dataclass(frozen=True)
class FieldUncertainty:
    """Standard deviations of the quantities that a field calibration does not estimate: set angles, tilt, azimuth,
    magnitude, neglected cross-couplings.
    """

    angle_sd_rad: float = 0.0
    """Setting error of each turn at each position, independent."""
    tilt_covariance_rad2: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))
    """Covariance of (α₀, β₀) where they are not estimated."""
    azimuth_sd_rad: float = 0.0
    cross_coupling_sd: float = 0.0
    """Standard deviation of each of the six neglected cross-couplings, relative to its channel's scale factor."""
    magnitude_relative_sd: float = 0.0
    scale_relative_sd: float = 0.0
    """Relative standard deviation of the nominal scale factor, where it is not estimated."""


@dataclass(frozen=True)
class FieldModel:
    """Model fitted to the positions: which parameters are estimated."""

    positions_rad: Array
    """(α, β), shape (n, 2)."""
    vector_r: Array
    """Specific force or Earth's rate in the axes of the level base, shape (3,)."""
    tilt: Tilt = "base"
    estimate_tilt: bool = False
    tilt_rad: tuple[float, float] = (0.0, 0.0)
    """Known tilt, or where the search for it begins."""
    estimate_scale: bool = True
    lever_min: float = 0.02
    """Least change of a channel's input between positions, relative to the magnitude, that shows a scale factor."""
    scale_sd_max: float = 0.1
    """Relative uncertainty at which a scale factor counts as not determined."""


@dataclass(frozen=True)
class FieldFit:
    """Bias and scale of three channels, and the tilt of the base, with their covariance and the residuals."""

    bias: Array
    scale: Array
    """Bias and scale of each channel, (3,) each; the scale is one where it was not estimated."""
    tilt_rad: Array
    """(α₀, β₀), estimated or as given, shape (2,)."""
    covariance: Array
    """Covariance of (b, k, α₀, β₀), shape (8, 8); zero for fixed parameters, but for a nominal scale."""
    residuals: Array
    """Shape (n, 3), in the output's unit."""
    residual_sd: Array
    """Their expected standard deviations, shape (n, 3)."""
    chi_square: float
    degrees_of_freedom: int
    noise_known: bool
    noise_share: float
    """Noise part of the outputs' variance; the rest is the declared uncertainty."""

    @property
    def p_value(self) -> float | None:
        """Probability of a chi-square at least as large; None where it cannot be judged."""
        return judged_p_value(self.chi_square, self.degrees_of_freedom, self.noise_known)

    @property
    def scale_relative_sd(self) -> Array:
        """Relative standard uncertainties of the scale factors, shape (3,)."""
        return np.sqrt(np.diagonal(self.covariance)[3:6]) / np.abs(self.scale)

    def calibration(self, triad: str, output_unit: str, input_unit: str, cross_sd: float) -> TriadCalibration:
        """Return ``U = b + K·v`` with K diagonal; the cross-couplings are zero with the spread declared."""
        coefficients = np.column_stack([self.bias, np.diag(self.scale)]).ravel()
        places = [0, 4, 8, 1, 6, 11]
        covariance = np.zeros((12, 12))
        covariance[np.ix_(places, places)] = self.covariance[:6, :6]
        for k in range(12):
            channel, column = divmod(k, 4)
            if column not in (0, channel + 1):
                covariance[k, k] = (cross_sd * self.scale[channel]) ** 2
        return triad_calibration(triad, output_unit, input_unit, coefficients, covariance, model="field")


def require_levers(what: str, model: FieldModel) -> None:
    """Refuse positions between which a channel's input hardly changes, naming the channels: `Undetermined`.

    Without tilt the two unknowns of a channel see nothing but that change (paper F 12, 13: ``sin α``,
    ``cos α·cos β − 1``, ``cos α·sin β``), and every error of angles and noise is divided by it.
    """
    vectors = field_vectors(model.positions_rad, model.vector_r, model.tilt, np.array(model.tilt_rad))
    levers = np.ptp(vectors, axis=0) / np.linalg.norm(model.vector_r)
    lost = [
        f"scale factor {axis} (its input changes by {100 * lever:.2g} % of the whole between the positions, "
        f"at least {100 * model.lever_min:g} % are needed: turn farther)"
        for axis, lever in zip("xyz", levers.tolist(), strict=True)
        if lever < model.lever_min
    ]
    if lost:
        condition = float(1.0 / max(levers.min(), 1e-12))
        raise Undetermined(what, lost, 6 - len(lost), 6, condition)


def fit_field(
    what: str,
    outputs: Array,
    noise_covariance: Array,
    model: FieldModel,
    uncertainty: FieldUncertainty,
    noise_known: bool = True,
) -> FieldFit:
    """Weighted least squares of mean outputs (n, 3); `noise_covariance` (3, n, n) per channel. Raises `Undetermined`.

    Where the noise is not known its first estimate is scaled up, never down, to what the residuals show.
    """
    if model.estimate_scale:
        require_levers(what, model)
    asked = _asked(model)
    theta = _start(outputs, model)
    noise = block_diag(*noise_covariance)
    whitened, flaws = np.eye(3 * len(outputs)), np.empty((3 * len(outputs), 0))
    jacobian = _jacobian(theta, model)[:, asked]
    require_full_rank(what, jacobian, [_NAMES[k] for k in asked])
    magnitude = float(np.linalg.norm(model.vector_r))
    sizes = np.array([*(np.abs(theta[3:6]) * magnitude), *np.abs(theta[3:6]), 1.0, 1.0])[asked]
    for _ in range(_PASSES):
        jacobian = _jacobian(theta, model)[:, asked]
        flaws = _flaws(theta, model, uncertainty)
        whitened = whitener(noise + flaws @ flaws.T)
        step, *_ = np.linalg.lstsq(whitened @ jacobian, whitened @ _residuals(theta, outputs, model), rcond=None)
        theta[asked] += step
        if np.all(np.abs(step) <= _SETTLED * sizes):
            break
    residuals = _residuals(theta, outputs, model)
    inverse = scaled_pinv(whitened @ jacobian)
    remaining = np.eye(len(residuals)) - jacobian @ inverse @ whitened
    left = np.einsum("ij,jk,ik->i", remaining, noise + flaws @ flaws.T, remaining, optimize=True)
    chi_square = float(np.sum((whitened @ residuals) ** 2))
    degrees = 3 * len(outputs) - len(asked)
    factor = residual_factor(chi_square, degrees, noise_known)
    covariance = np.zeros((8, 8))
    covariance[np.ix_(asked, asked)] = inverse @ inverse.T * factor
    if not model.estimate_scale:
        covariance[3:6, 3:6] = uncertainty.scale_relative_sd**2 * np.eye(3)
    fit = FieldFit(
        theta[:3],
        theta[3:6],
        theta[6:],
        covariance,
        residuals.reshape(3, -1).T,
        np.sqrt(np.maximum(left * factor, 0.0)).reshape(3, -1).T,
        chi_square,
        degrees,
        noise_known,
        float(np.trace(noise) / np.trace(noise + flaws @ flaws.T)),
    )
    if model.estimate_scale:
        _require_scales(what, fit, model.scale_sd_max)
    return fit


_NAMES = ("bias x", "bias y", "bias z", "scale x", "scale y", "scale z", "tilt α₀", "tilt β₀")


def _asked(model: FieldModel) -> list[int]:
    return [0, 1, 2, *((3, 4, 5) if model.estimate_scale else ()), *((6, 7) if model.estimate_tilt else ())]


def _require_scales(what: str, fit: FieldFit, sd_max: float) -> None:
    lost = [
        f"scale factor {axis} (its standard uncertainty would be {100 * sd:.2g} %)"
        for axis, sd in zip("xyz", fit.scale_relative_sd.tolist(), strict=True)
        if not sd <= sd_max
    ]
    if lost:
        raise Undetermined(what, lost, 8 - len(lost), 8, float(fit.scale_relative_sd.max()))


def _vectors(theta: Array, model: FieldModel) -> Array:
    return field_vectors(model.positions_rad, model.vector_r, model.tilt, theta[6:])


def _start(outputs: Array, model: FieldModel) -> Array:
    """Channel by channel with the tilt as given: paper F 11-14 for two positions."""
    theta = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0, *model.tilt_rad])
    vectors = _vectors(theta, model)
    for c in range(3):
        if model.estimate_scale:
            design = np.column_stack([np.ones(len(vectors)), vectors[:, c]])
            theta[[c, 3 + c]] = np.linalg.lstsq(design, outputs[:, c], rcond=None)[0]
        else:
            theta[c] = float(np.mean(outputs[:, c] - vectors[:, c]))
    return theta


def _residuals(theta: Array, outputs: Array, model: FieldModel) -> Array:
    """Outputs minus model, channel by channel, shape (3n,)."""
    return (outputs - theta[:3] - theta[3:6] * _vectors(theta, model)).T.ravel()


def _stack(changes: Sequence[Array]) -> Array:
    """Changes (n, 3, P) of the outputs as one matrix (3n, ΣP), channel by channel."""
    return np.hstack([c.transpose(1, 0, 2).reshape(-1, c.shape[2]) for c in changes])


def _jacobian(theta: Array, model: FieldModel) -> Array:
    """∂U/∂(b, k, α₀, β₀), shape (3n, 8)."""
    vectors = _vectors(theta, model)
    n = len(vectors)
    of_bias = np.broadcast_to(np.eye(3), (n, 3, 3))
    of_scale = vectors[:, :, None] * np.eye(3)
    tilt = theta[3:6, None] * of_tilt(model.positions_rad, model.vector_r, model.tilt, theta[6:])
    return _stack([of_bias, of_scale, tilt])


def _flaws(theta: Array, model: FieldModel, uncertainty: FieldUncertainty) -> Array:
    """Changes of the outputs per standard deviation of what is taken as known, shape (3n, P)."""
    where = (model.positions_rad, model.vector_r, model.tilt, theta[6:])
    u, scale, vectors = uncertainty, theta[3:6, None], _vectors(theta, model)
    root = np.linalg.eigh(np.array(u.tilt_covariance_rad2))
    tilt = root[1] * np.sqrt(np.maximum(root[0], 0.0)) * (0.0 if model.estimate_tilt else 1.0)
    cross = np.zeros((len(vectors), 3, 9))
    for i in range(3):
        for j in range(3):
            if i != j:
                cross[:, i, 3 * i + j] = vectors[:, j]
    scales = vectors[:, :, None] * np.eye(3) * (0.0 if model.estimate_scale else u.scale_relative_sd)
    parts = [
        of_settings(*where) * u.angle_sd_rad,
        of_tilt(*where) @ tilt,
        of_azimuth(*where)[:, :, None] * u.azimuth_sd_rad,
        cross * u.cross_coupling_sd,
        vectors[:, :, None] * u.magnitude_relative_sd,
        scales,
    ]
    return _stack([scale * part for part in parts])
