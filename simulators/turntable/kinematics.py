"""True attitude of the unit on an imperfect table, in matrices; the plant has the same table in MuJoCo bodies.

``rot_enu_b = B · W_o·R_y(outer) · R_x(ε_om) · W_m·R_z(middle) · R_y(ε_mi) · W_i·R_x(inner)`` (see `TableTruth`).
World axes are east, north, up. The base B is ``Tilt · R_up(−azimuth) · M``, where M lays the unit's x, y, z at zero
angles along north, up, east. Wobble W of an axis is a small turn by ``amplitude·sin θ`` about the coordinate
axis that follows its own in the order x, y, z. Nothing here is shared with `procedures.core.frames`.
"""

import numpy as np

from procedures.core import units
from simulators.truth import Array, SiteTruth, TableTruth

X, Y, Z = 0, 1, 2


def turn(axis: int, angle_rad: Array | float) -> Array:
    """Right-hand turn about a coordinate axis, shape (n, 3, 3)."""
    angle = np.atleast_1d(np.asarray(angle_rad, dtype=np.float64))
    second, third = (axis + 1) % 3, (axis + 2) % 3
    rot = np.zeros((len(angle), 3, 3))
    rot[:, axis, axis] = 1.0
    rot[:, second, second] = rot[:, third, third] = np.cos(angle)
    rot[:, third, second] = np.sin(angle)
    rot[:, second, third] = -rot[:, third, second]
    return rot


def cross_matrix(v: Array) -> Array:
    """``[v×]`` for vectors of shape (n, 3), shape (n, 3, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 2, 1], out[:, 0, 2], out[:, 1, 0] = v[:, 0], v[:, 1], v[:, 2]
    return out - out.transpose(0, 2, 1)


def small_turn(vector_rad: Array) -> Array:
    """Turn by rotation vectors (n, 3), by Rodrigues' formula, shape (n, 3, 3)."""
    size = np.linalg.norm(vector_rad, axis=1)[:, None, None]
    safe = np.where(size > 0.0, size, 1.0)
    cross = cross_matrix(vector_rad)
    half = np.sin(0.5 * size) / (0.5 * safe)
    return np.eye(3) + np.sin(size) / safe * cross + 0.5 * half**2 * (cross @ cross)


def wobble_vector(axis: int, amplitude_arcsec: float, angle_rad: Array) -> Array:
    """Rotation vector of an axis' wobble at its angle, (n, 3) [rad]."""
    vector = np.zeros((len(angle_rad), 3))
    vector[:, (axis + 1) % 3] = amplitude_arcsec * units.ARCSEC * np.sin(angle_rad)
    return vector


def base_attitude(table: TableTruth, azimuth_deg: float) -> Array:
    """Attitude B of the base, from its axes to east, north, up, (3, 3): the declared azimuth plus its error, and the
    tilt.
    """
    heading = azimuth_deg * units.DEG + table.azimuth_error_arcsec * units.ARCSEC
    lay = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    lean = units.ARCSEC * np.array([[-table.base_tilt_north_arcsec, table.base_tilt_east_arcsec, 0.0]])
    return (small_turn(lean) @ turn(Z, -heading) @ lay)[0]


def attitude(axes_rad: Array, table: TableTruth, azimuth_deg: float) -> Array:
    """``rot_enu_b`` at true axis angles outer, middle, inner of shape (n, 3), shape (n, 3, 3)."""
    outer, middle, inner = axes_rad.T
    rot = base_attitude(table, azimuth_deg)[None]
    if table.outer_wobble_arcsec > 0.0:
        rot = rot @ small_turn(wobble_vector(Y, table.outer_wobble_arcsec, outer))
    rot = rot @ turn(Y, outer) @ turn(X, table.outer_middle_nonorthogonality_arcsec * units.ARCSEC)
    if table.middle_wobble_arcsec > 0.0:
        rot = rot @ small_turn(wobble_vector(Z, table.middle_wobble_arcsec, middle))
    rot = rot @ turn(Z, middle) @ turn(Y, table.middle_inner_nonorthogonality_arcsec * units.ARCSEC)
    if table.inner_wobble_arcsec > 0.0:
        rot = rot @ small_turn(wobble_vector(X, table.inner_wobble_arcsec, inner))
    return rot @ turn(X, inner)


def earth_rate_enu(site: SiteTruth) -> Array:
    """Earth's rate ``Ω·[0, cos L, sin L]``, (3,) [rad/s]."""
    latitude = site.latitude_deg * units.DEG
    return site.earth_rate_rad_s * np.array([0.0, np.cos(latitude), np.sin(latitude)])


def at_rest(rot_enu_b: Array, site: SiteTruth) -> tuple[Array, Array]:
    """Angular rate and specific force of a unit at rest, each (n, 3): ``Cᵀ·Ω_enu`` and ``−Cᵀ·g_enu``."""
    rate = np.einsum("nij,i->nj", rot_enu_b, earth_rate_enu(site))
    return rate, rot_enu_b[:, 2, :] * site.gravity_m_s2


def path_increments(rot_enu_b: Array, per_tick: int, tick_s: float, site: SiteTruth) -> tuple[Array, Array]:
    """Angle and velocity increments of each tick along a path, each (n, 3).

    `rot_enu_b`: attitudes at n·per_tick + 1 equal steps. Angle: ``∫ω dt``, the sum over a tick's steps of
    ``log(C_kᵀ·C_{k+1})``, plus the Earth's turn; velocity: ``−∫Cᵀ·g dt``; the last two by the trapezoid over the steps
    (the accelerometers stand where the axes meet and do not travel).
    """
    turned = np.matmul(rot_enu_b[:-1].transpose(0, 2, 1), rot_enu_b[1:])
    vector = 0.5 * np.stack([turned[:, i, j] - turned[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1)
    sine = np.linalg.norm(vector, axis=1)
    vector *= np.where(sine > 1e-8, np.arcsin(np.minimum(sine, 1.0)) / np.maximum(sine, 1e-300), 1.0)[:, None]
    rate, force = at_rest(rot_enu_b, site)
    step_s = tick_s / per_tick
    angle = vector + 0.5 * step_s * (rate[:-1] + rate[1:])
    velocity = 0.5 * step_s * (force[:-1] + force[1:])
    return angle.reshape(-1, per_tick, 3).sum(axis=1), velocity.reshape(-1, per_tick, 3).sum(axis=1)
