"""Other forms of ``U = b + K·v``: the inverse with its covariance, and the split into triangle and rotation."""

from dataclasses import dataclass

import numpy as np

from procedures.core.arrays import Array
from procedures.core.imu_model import TriadCalibration


@dataclass(frozen=True)
class InverseModel:
    """Inverse model ``v = A·U + c`` of a calibration: A = K⁻¹, c = −K⁻¹·b, and the covariance of A and c."""

    matrix: Array
    """A (3, 3), input unit a output unit."""
    offset: Array
    """c (3,), in the input unit."""
    covariance: Array
    """Covariance (12, 12) in the order c_x, A11, A12, A13, c_y, …, to first order."""


def inverse_model(calibration: TriadCalibration) -> InverseModel:
    """Return the inverse model of a calibration; ``dA = −A·dK·A``, ``dc = −A·(db + dK·c)`` give its covariance to first
    order.
    """
    a: Array = np.asarray(np.linalg.inv(calibration.matrix_array), dtype=np.float64)
    c = -a @ calibration.bias_array
    jacobian = np.empty((12, 12))
    for channel in range(3):
        for place in range(4):
            d_b, d_k = np.zeros(3), np.zeros((3, 3))
            if place == 0:
                d_b[channel] = 1.0
            else:
                d_k[channel, place - 1] = 1.0
            d_a, d_c = -a @ d_k @ a, -a @ (d_b + d_k @ c)
            jacobian[:, 4 * channel + place] = np.column_stack([d_c, d_a]).ravel()
    covariance = jacobian @ calibration.covariance_array @ jacobian.T
    return InverseModel(a, c, (covariance + covariance.T) / 2.0)


def triangle_and_rotation(matrix: Array) -> tuple[Array, Array]:
    """Return L and Q of ``K = L·Q``: L lower triangular with a positive diagonal, Q orthogonal; both (3, 3).

    Q is a rotation where det K > 0; for a unit whose axes are left-handed Q has the determinant −1.
    """
    q_t, r = np.linalg.qr(matrix.T)
    signs = np.where(np.diagonal(r) < 0.0, -1.0, 1.0)
    lower, rotation = (r.T * signs), (q_t * signs).T
    return np.tril(lower), rotation
