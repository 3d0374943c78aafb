"""Scalar calibration of a triad: nine parameters from the magnitude of the measured vector alone (thesis 3.3.1,
3.21-3.24).

No orientation is trusted: neither the table's angles nor the quaternions of thesis 3.26-3.27 enter. The model is
``v̂ = T·S·(U − b)``, T upper triangular with a unit diagonal, S diagonal, and ``|v̂|`` is the reference; so K =
(T·S)⁻¹ is upper triangular. The linear system of thesis 3.23 judges rank and condition; the solve iterates the exact
magnitude, because real units have scale errors far beyond its first order.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from procedures.analysis.calibration.magnitude import magnitude_covariance, magnitude_gradient
from procedures.analysis.least_squares.chi_square import judged_p_value, residual_factor
from procedures.analysis.least_squares.determination import RANK_TOLERANCE, require_full_rank
from procedures.analysis.least_squares.ellipsoid import ellipsoid
from procedures.analysis.least_squares.inverse import scaled_pinv
from procedures.analysis.least_squares.whitening import whitener
from procedures.core.arrays import Array
from procedures.core.errors import Undetermined
from procedures.core.imu_model import TriadCalibration, triad_calibration

PARAMETERS = ("b_x", "b_y", "b_z", "s_x", "s_y", "s_z", "t_xy", "t_xz", "t_yz")
"""Bias in the output's unit, SI per output unit, and the upper triangle of T [rad]."""

_LOST = (
    "bias x",
    "bias y",
    "bias z",
    "scale factor x",
    "scale factor y",
    "scale factor z",
    "misalignment difference x–y (δ_xz − δ_yz)",
    "misalignment difference x–z (δ_zy − δ_xy)",
    "misalignment difference y–z (δ_yx − δ_zx)",
)
_PASSES = 3
"""Solves, each with the weights that the one before it gives; the weights hardly change after the first."""


@dataclass(frozen=True)
class ScalarFit:
    """Nine parameters of a triad with their covariance. Shapes: parameters (9,), covariance (9, 9), residuals (n,)."""

    parameters: Array
    """Parameters in the order of `PARAMETERS`."""
    covariance: Array
    condition: float
    """Condition number of the linear system of thesis 3.23 at these stations, columns scaled."""
    residuals: Array
    """|v̂| − reference [SI], shape (n,)."""
    residual_sd: Array
    """Expected standard deviations of the residuals, shape (n,)."""
    chi_square: float
    degrees_of_freedom: int
    noise_known: bool
    gain: Array
    """Change of the parameters per change of each output, ∂θ̂/∂U, shape (9, n, 3)."""

    @property
    def standard_uncertainties(self) -> Array:
        """Standard uncertainties of the nine parameters, shape (9,)."""
        return np.sqrt(np.diagonal(self.covariance))

    @property
    def correction(self) -> Array:
        """T·S, shape (3, 3): ``v̂ = T·S·(U − b)``."""
        return correction_matrix(self.parameters)

    @property
    def p_value(self) -> float | None:
        """Probability of a chi-square at least as large; None where it cannot be judged."""
        return judged_p_value(self.chi_square, self.degrees_of_freedom, self.noise_known)

    def calibration(self, triad: str, output_unit: str, input_unit: str) -> TriadCalibration:
        """Return ``U = b + K·v`` with K upper triangular; its lower triangle is fixed and has no variance."""
        jacobian = _linear_derivative(self.parameters)
        covariance = jacobian @ self.covariance @ jacobian.T
        coefficients = linear_coefficients(self.parameters)
        return triad_calibration(triad, output_unit, input_unit, coefficients, covariance, model="scalar")


def correction_matrix(parameters: Array) -> Array:
    """Return T·S of the nine parameters, shape (3, 3)."""
    t_xy, t_xz, t_yz = parameters[6:]
    return np.array([[1.0, t_xy, t_xz], [0.0, 1.0, t_yz], [0.0, 0.0, 1.0]]) * parameters[3:6]


def linear_coefficients(parameters: Array) -> Array:
    """Return the twelve of ``U = b + K·v``, K = (T·S)⁻¹, in the order of `COEFFICIENT_NAMES`, shape (12,)."""
    matrix = np.triu(np.linalg.inv(correction_matrix(parameters)))
    return np.asarray(np.column_stack([parameters[:3], matrix]), dtype=np.float64).ravel()


def _linear_derivative(parameters: Array) -> Array:
    """∂(twelve)/∂(nine) of `linear_coefficients`, shape (12, 9): ``∂K = −K·∂(T·S)·K``."""
    t, scale = correction_matrix(parameters) / parameters[3:6], parameters[3:6]
    matrix = np.linalg.inv(t * scale)
    derivative = np.zeros((9, 3, 4))
    derivative[(0, 1, 2), (0, 1, 2), 0] = 1.0
    changes = [t * unit for unit in np.eye(3)]
    changes += [np.outer(np.eye(3)[i], np.eye(3)[j]) * scale for i, j in ((0, 1), (0, 2), (1, 2))]
    for k, change in enumerate(changes, start=3):
        derivative[k, :, 1:] = -np.triu(matrix @ change @ matrix)
    return derivative.reshape(9, 12).T


def scalar_parameters(coefficients: Array) -> Array:
    """The nine that a full linear calibration implies: K·R upper triangular by a turn R, which no magnitude can see.

    `coefficients` (12,) in the order of `COEFFICIENT_NAMES`; returns (9,) in the order of `PARAMETERS`.
    """
    by_channel = coefficients.reshape(3, 4)
    correction = np.linalg.qr(np.linalg.inv(by_channel[:, 1:]))[1]
    correction = correction * np.sign(np.diagonal(correction))[:, None]
    scale = np.diagonal(correction)
    t = correction / scale
    return np.array([*by_channel[:, 0], *scale, t[0, 1], t[0, 2], t[1, 2]])


def observable_derivative(coefficients: Array) -> Array:
    """Return ∂(nine)/∂(twelve) of `scalar_parameters`, by central differences, shape (9, 12)."""
    matrix = coefficients.reshape(3, 4)[:, 1:]
    step = 1e-6 * float(np.linalg.norm(matrix)) * np.eye(12)
    derivative = [(scalar_parameters(coefficients + h) - scalar_parameters(coefficients - h)) / 2.0 for h in step]
    return np.array(derivative).T / step[0, 0]


def require_scalar_determined(what: str, directions: Array, tolerance: float = RANK_TOLERANCE) -> float:
    """Return the condition number of thesis 3.23 for unit vectors (n, 3). Raises `Undetermined` naming the lost
    combinations.

    Row: ``[g_x g_y g_z g_x² g_y² g_z² g_x·g_y g_x·g_z g_y·g_z]`` (thesis 3.21).
    """
    x, y, z = directions.T
    design = np.column_stack([x, y, z, x * x, y * y, z * z, x * y, x * z, y * z])
    return require_full_rank(what, design, _LOST, tolerance)


def fit_scalar(
    what: str, outputs: Array, noise_covariance: Array, reference: float, start: Array, noise_known: bool = True
) -> ScalarFit:
    """Weighted least squares of ``|T·S·(U − b)| = reference`` over stations.

    Parameters
    ----------
    outputs : (n, 3) station means in any unit. noise_covariance : (3, n, n), per channel, in that unit squared.
    reference : magnitude [SI]. start : (9,) first guess, from `nominal_start` or `start_from_data`.

    The covariance of the magnitudes is ``Σ_c diag(w_c)·C_c·diag(w_c)``, w the direction cosines through the correction.
    Where the noise is not known it is scaled up, never down, to what the residuals show.
    """
    directions = (outputs - start[:3]) @ correction_matrix(start).T
    # A pose in the middle of all, such as the only one, shows no direction: it is a row of zeros, which adds no rank.
    lengths = np.linalg.norm(directions, axis=1)[:, None]
    condition = require_scalar_determined(what, directions / np.where(lengths > 0.0, lengths, 1.0))
    parameters = start
    for _ in range(_PASSES):
        weights = whitener(_magnitude_covariance(parameters, outputs, noise_covariance))
        parameters = _solve(parameters, outputs, reference, weights)
    parameters = _upright(parameters)
    covariance_f = _magnitude_covariance(parameters, outputs, noise_covariance)
    weights = whitener(covariance_f)
    jacobian = _jacobian(parameters, outputs)
    inverse = scaled_pinv(weights @ jacobian)
    solve = inverse @ weights
    residuals = _magnitudes(parameters, outputs) - reference
    whitened = weights @ residuals
    chi_square, degrees = float(whitened @ whitened), len(outputs) - 9
    factor = residual_factor(chi_square, degrees, noise_known)
    remaining = np.eye(len(outputs)) - jacobian @ solve
    expected = np.diagonal(remaining @ covariance_f @ remaining.T) * factor
    gain = -np.einsum("pn,nc->pnc", solve, _output_weights(parameters, outputs))
    residual_sd = np.sqrt(np.maximum(expected, 0.0))
    return ScalarFit(
        parameters,
        inverse @ inverse.T * factor,
        condition,
        residuals,
        residual_sd,
        chi_square,
        degrees,
        noise_known,
        gain,
    )


def fit_from_starts(
    what: str, outputs: Array, noise_covariance: Array, reference: float, starts: Sequence[Array], noise_known: bool
) -> ScalarFit:
    """Return the fit of least chi-square from several first guesses: poses on one side have more than one minimum.

    Raises `Undetermined` where no guess determines all parameters.
    """
    fits: list[ScalarFit] = []
    for start in starts:
        try:
            fits.append(fit_scalar(what, outputs, noise_covariance, reference, start, noise_known))
        except Undetermined:
            if start is starts[-1] and not fits:
                raise
    return min(fits, key=lambda fit: fit.chi_square)


def nominal_start(reference_scale: float = 1.0) -> Array:
    """Return the first guess of the nine parameters for outputs in nominal SI units, shape (9,)."""
    return np.array([0.0] * 3 + [reference_scale] * 3 + [0.0] * 3)


def start_from_data(outputs: Array, reference: float) -> Array:
    """Return the first guess for outputs of unknown scale: bias and scale from the extremes of each channel, shape
    (9,).
    """
    low, high = outputs.min(axis=0), outputs.max(axis=0)
    span = np.where(high > low, high - low, 1.0)
    return np.array([*(0.5 * (low + high)), *(2.0 * reference / span), 0.0, 0.0, 0.0])


def starts_from_data(outputs: Array, reference: float) -> tuple[Array, ...]:
    """Return first guesses (9,) for outputs of unknown scale: the ellipsoid through them where they lie on one, no bias
    at all, and the extremes of each channel.
    """
    length = float(np.median(np.linalg.norm(outputs, axis=1)))
    guesses = [nominal_start(reference / length)] if length > 0.0 else []
    found = ellipsoid(outputs) if len(outputs) >= len(PARAMETERS) else None
    if found is not None:
        centre, upper = found
        scale = np.diagonal(upper)
        t = upper / scale
        guesses.insert(0, np.array([*centre, *(reference * scale), t[0, 1], t[0, 2], t[1, 2]]))
    return (*guesses, start_from_data(outputs, reference))


def _solve(start: Array, outputs: Array, reference: float, weights: Array) -> Array:
    units = _steps(start, reference)

    def whitened(p: Array) -> Array:
        return weights @ (_magnitudes(start + p * units, outputs) - reference)

    def derivative(p: Array) -> Array:
        return weights @ _jacobian(start + p * units, outputs) * units

    found = least_squares(whitened, np.zeros(9), jac=derivative, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return start + found.x * units


def _upright(parameters: Array) -> Array:
    """Make the scale factors positive at the same magnitudes: negating a row of T·S leaves every magnitude."""
    signs = np.where(parameters[3:6] < 0.0, -1.0, 1.0)
    scale = parameters[3:6] * signs
    t_xy, t_xz, t_yz = parameters[6:]
    angles = [t_xy * signs[0] * signs[1], t_xz * signs[0] * signs[2], t_yz * signs[1] * signs[2]]
    return np.array([*parameters[:3], *scale, *angles])


def _steps(parameters: Array, reference: float) -> Array:
    """Natural size of each parameter, so that one number measures all steps."""
    scale = np.abs(parameters[3:6])
    return np.concatenate([reference / scale, scale, np.ones(3)])


def _magnitudes(parameters: Array, outputs: Array) -> Array:
    return np.linalg.norm((outputs - parameters[:3]) @ correction_matrix(parameters).T, axis=1)


def _output_weights(parameters: Array, outputs: Array) -> Array:
    """∂|v̂|/∂U, shape (n, 3): direction cosines through the correction."""
    correction = correction_matrix(parameters)
    return magnitude_gradient((outputs - parameters[:3]) @ correction.T, correction)


def _jacobian(parameters: Array, outputs: Array) -> Array:
    """Derivatives ∂|v̂|/∂θ of the magnitude, shape (n, 9)."""
    centred = outputs - parameters[:3]
    corrected = centred @ correction_matrix(parameters).T
    u = corrected / np.linalg.norm(corrected, axis=1)[:, None]
    weights = _output_weights(parameters, outputs)
    scaled = centred * parameters[3:6]
    of_scale = weights * centred / parameters[3:6]
    of_angles = [u[:, 0] * scaled[:, 1], u[:, 0] * scaled[:, 2], u[:, 1] * scaled[:, 2]]
    return np.column_stack([-weights, of_scale, *of_angles])


def _magnitude_covariance(parameters: Array, outputs: Array, noise_covariance: Array) -> Array:
    return magnitude_covariance(_output_weights(parameters, outputs), noise_covariance)
