"""Inputs of a unit in positions (α, β) set by hand: α about z, then β about the turned x (paper F 1-3).

``v_b = R_x(β)ᵀ·R_z(α)ᵀ·v_r``, in table angles middle = α and inner = β. The base may lie wrong in two ways, both by two
small angles. "base": it is tilted under both turns, ``v_r = R_x(β₀)ᵀ·R_z(α₀)ᵀ·v``. "turn_zeros": the zeros of the two
turns are off, ``α + α₀`` and ``β + β₀``. Paper F 15 is the second, contrary to its wording, and so are the figures of
its Table 2 (the tests recompute them).

Further errata of paper F: its axes (east, up, north) are left-handed; this module turns x to the west for its
[0, Ω sin φ, Ω cos φ]. In paper F 5, 8, 10, 12, 15 the third component lacks the minus of the product in equation 4:
with specific force +g on y it is ``−g·cos α·sin β``.
"""

from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from procedures.core.arrays import Array

Tilt = Literal["base", "turn_zeros"]
_STEP = 1e-6
"""Step of the central differences [rad]: their error is of the order of its square."""


def field_vectors(positions_rad: Array, vector_r: Array, tilt: Tilt, tilt_rad: Array) -> Array:
    """Return a constant vector (3,) in the unit's axes, shape (n, 3), at positions (n, 2) with the base off by (α₀,
    β₀).
    """
    alpha, beta = positions_rad[:, 0], positions_rad[:, 1]
    vector = vector_r
    if tilt == "base":
        vector = Rotation.from_euler("ZX", tilt_rad).inv().apply(vector_r)
    else:
        alpha, beta = alpha + tilt_rad[0], beta + tilt_rad[1]
    turned = Rotation.from_euler("ZX", np.column_stack([alpha, beta])).inv()
    return np.asarray(turned.apply(vector), dtype=np.float64).reshape(-1, 3)


def of_tilt(positions_rad: Array, vector_r: Array, tilt: Tilt, tilt_rad: Array) -> Array:
    """Return ∂v/∂(α₀, β₀), the change of the inputs by the tilt of the base, shape (n, 3, 2)."""
    columns = [
        (
            field_vectors(positions_rad, vector_r, tilt, tilt_rad + step)
            - field_vectors(positions_rad, vector_r, tilt, tilt_rad - step)
        )
        / (2.0 * _STEP)
        for step in _STEP * np.eye(2)
    ]
    return np.stack(columns, axis=2)


def of_settings(positions_rad: Array, vector_r: Array, tilt: Tilt, tilt_rad: Array) -> Array:
    """Return ∂v/∂(α_i, β_i) of each position's own angles, shape (n, 3, 2n): a position's columns are zero
    elsewhere.
    """
    n = len(positions_rad)
    found = np.zeros((n, 3, 2 * n))
    for turn in range(2):
        step = _STEP * np.eye(2)[turn]
        ahead = field_vectors(positions_rad + step, vector_r, tilt, tilt_rad)
        behind = field_vectors(positions_rad - step, vector_r, tilt, tilt_rad)
        found[np.arange(n), :, 2 * np.arange(n) + turn] = (ahead - behind) / (2.0 * _STEP)
    return found


def of_azimuth(positions_rad: Array, vector_r: Array, tilt: Tilt, tilt_rad: Array) -> Array:
    """Return ∂v/∂(heading of the base), shape (n, 3): the whole arrangement turned about up."""
    change = np.cross(np.array([0.0, 1.0, 0.0]), vector_r)
    return field_vectors(positions_rad, change, tilt, tilt_rad)
