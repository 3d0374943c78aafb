"""Error-model coefficients of a triad and the correction they give.

The model is ``U = b + K·v + n`` (thesis 3.30, 3.34): U the unit's nominal output, v the specific force or
angular rate in its orthogonal axes. This module has the *type* and the inverse; the forward model that makes data
is written a second time, independently, in the simulator.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from procedures.core.arrays import Array

Vector = tuple[float, ...]
Matrix = tuple[tuple[float, ...], ...]

COEFFICIENT_NAMES = tuple(name for i in (1, 2, 3) for name in (f"b_{'xyz'[i - 1]}", f"K{i}1", f"K{i}2", f"K{i}3"))
"""Per triad, channel by channel: [b, K_i1, K_i2, K_i3] for i = x, y, z."""


def coefficient_unit(name: str, output_unit: str, input_unit: str) -> str:
    """Return the unit of a coefficient as text: of b the output's; of K "1" where output and input have the same
    unit.
    """
    if name.startswith("b"):
        return output_unit
    return "1" if output_unit == input_unit else f"{output_unit}/({input_unit})"


@dataclass(frozen=True)
class TriadCalibration:
    """Calibration coefficients of one triad, with the covariance of their estimate.

    Plain tuples, so that the whole is JSON; `array` forms are the properties below. Order in `covariance`, 12×12:
    as `COEFFICIENT_NAMES`. A coefficient that the method fixes (the lower triangle of a scalar calibration) has
    zero variance. Make one from arrays with `triad_calibration`.
    """

    triad: str
    """Triad by its name, either "gyro" or "accelerometer"."""
    output_unit: str
    """Unit of the output U and of b: "rad/s", "m/s^2" or "count"."""
    input_unit: str
    """Unit of the input v, "rad/s" or "m/s^2"."""
    bias: Vector
    matrix: Matrix
    covariance: Matrix = field(repr=False)
    model: str = "linear"
    """"linear" (full K against known vectors), "scalar" (K upper triangular, magnitude as the only reference),
    "field" (K diagonal; cross-couplings zero with the spread that was declared) or "entered" (typed by a person)."""

    def __post_init__(self) -> None:
        for name, value, shape in (
            ("bias", self.bias_array, (3,)),
            ("matrix", self.matrix_array, (3, 3)),
            ("covariance", self.covariance_array, (12, 12)),
        ):
            if value.shape != shape or not np.all(np.isfinite(value)):
                raise ValueError(f"calibration.{name} must be finite and of shape {shape}, got {value.shape}")

    @property
    def bias_array(self) -> Array:
        """Bias b as an array, shape (3,)."""
        return np.array(self.bias, dtype=np.float64)

    @property
    def matrix_array(self) -> Array:
        """Matrix K as an array, shape (3, 3)."""
        return np.array(self.matrix, dtype=np.float64)

    @property
    def covariance_array(self) -> Array:
        """Covariance of all twelve coefficients, shape (12, 12), in the order of `COEFFICIENT_NAMES`."""
        return np.array(self.covariance, dtype=np.float64)

    @property
    def coefficients(self) -> Array:
        """All twelve coefficients in the order of `COEFFICIENT_NAMES`, shape (12,)."""
        return np.column_stack([self.bias_array, self.matrix_array]).ravel()

    @property
    def standard_uncertainties(self) -> Array:
        """Square root of the covariance's diagonal, shape (12,)."""
        return np.sqrt(np.diagonal(self.covariance_array))

    @property
    def correlations(self) -> Array:
        """Correlation of each pair of coefficients, shape (12, 12): 1 on the diagonal, 0 with a fixed coefficient."""
        sd = self.standard_uncertainties
        safe = np.where(sd > 0.0, sd, 1.0)
        found = self.covariance_array / np.outer(safe, safe)
        np.fill_diagonal(found, 1.0)
        return found


def triad_calibration(
    triad: str,
    output_unit: str,
    input_unit: str,
    coefficients: ArrayLike,
    covariance: ArrayLike,
    model: str = "linear",
) -> TriadCalibration:
    """Return a calibration made from arrays: `coefficients` shape (12,), `covariance` shape (12, 12), both ordered as
    named.
    """
    by_channel = np.asarray(coefficients, dtype=np.float64).reshape(3, 4)
    return TriadCalibration(
        triad,
        output_unit,
        input_unit,
        tuple(by_channel[:, 0].tolist()),
        tuple(tuple(row) for row in by_channel[:, 1:].tolist()),
        tuple(tuple(row) for row in np.asarray(covariance, dtype=np.float64).tolist()),
        model,
    )


def correct(output: Array, calibration: TriadCalibration) -> Array:
    """Return corrected vectors ``v̂ = K⁻¹(U − b)``, shape of `output`, (3,) or (n, 3) (thesis 3.36, 3.37)."""
    centred = np.atleast_2d(output) - calibration.bias_array
    corrected = np.asarray(np.linalg.solve(calibration.matrix_array, centred.T).T, dtype=np.float64)
    return corrected.reshape(output.shape)
