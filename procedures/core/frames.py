"""Attitudes of the unit on the table, and gravity and the Earth's rotation in its axes.

This is the geometry that the *analysis* uses: commanded angles through ideal, orthogonal axes. The simulated table has
its own kinematics (MuJoCo bodies) and shares nothing with this file.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles


def table_rotation(angles: TableAngles) -> Rotation:
    """Return the attitude of the unit for ideal axes, ``rot_rb = R_y(outer) · R_z(middle) · R_x(inner)`` (see
    `procedures`).

    In the thesis's (β, γ): inner = β, middle = γ, so ``v_b = R_x(β)ᵀ · R_z(γ)ᵀ · v_r``.
    """
    return Rotation.from_euler("YZX", [angles.outer_deg, angles.middle_deg, angles.inner_deg], degrees=True)


def orientation_beta_gamma(beta_deg: float, gamma_deg: float) -> TableAngles:
    """Return the table angles of a thesis orientation: β about x *after* γ about z (thesis 5.1, figure 5.4)."""
    return TableAngles(0.0, gamma_deg, beta_deg)


def orientation_gamma_beta(beta_deg: float, gamma_deg: float) -> TableAngles:
    """Table angles of the other order, γ about z *after* β about x: ``rot_rb = R_x(β) · R_z(γ)``.

    The gimbals turn in their own order, so the attitude is decomposed into outer, middle and inner angles.
    """
    attitude = Rotation.from_euler("XZ", [beta_deg, gamma_deg], degrees=True)
    outer, middle, inner = attitude.as_euler("YZX", degrees=True, suppress_warnings=True)
    return TableAngles(float(outer), float(middle), float(inner))


def reference_rotation(azimuth_deg: float) -> Rotation:
    """Return the rotation ``rot_nr`` from reference axes to local level: a clockwise azimuth is a turn of −azimuth
    about up.
    """
    return Rotation.from_euler("y", -azimuth_deg, degrees=True)


def specific_force_b(angles: list[TableAngles], site: Site) -> Array:
    """Return the specific force of a unit at rest in its own axes, shape (n, 3) [m/s²]: ``rot_rbᵀ · [0, g, 0]``."""
    up_r = np.array([0.0, site.gravity_m_s2, 0.0])
    return np.array([table_rotation(a).inv().apply(up_r) for a in angles]).reshape(-1, 3)


LEVEL_SHARE = 0.99
"""Least share of gravity along an axis that counts as upwards: it stands within 8°."""


def upward_axis(angles: TableAngles) -> int | None:
    """Return the index of the unit's axis that stands upwards, 0 … 2; None where none has `LEVEL_SHARE` of gravity
    along it.
    """
    up_b = table_rotation(angles).inv().apply(np.array([0.0, 1.0, 0.0]))
    upmost = int(np.argmax(up_b))
    return upmost if up_b[upmost] >= LEVEL_SHARE else None


def earth_rate_b(angles: list[TableAngles], site: Site) -> Array:
    """Return the Earth's angular velocity in the unit's axes, shape (n, 3) [rad/s].

    ``rot_rbᵀ · rot_nrᵀ · Ω · [cos L, sin L, 0]`` (Groves 2nd ed., 2.4.1, in north-up-east order).
    """
    latitude = site.latitude_deg * units.DEG
    rate_n = site.earth_rate_rad_s * np.array([np.cos(latitude), np.sin(latitude), 0.0])
    rate_r = reference_rotation(site.azimuth_deg).inv().apply(rate_n)
    return np.array([table_rotation(a).inv().apply(rate_r) for a in angles]).reshape(-1, 3)
