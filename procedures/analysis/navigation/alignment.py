"""Initial alignment of a parked unit: heading, pitch and roll from its mean specific force and angular rate.

The attitude is ``rot_nb = R_y(−heading)·R_z(pitch)·R_x(roll)`` from north, up, east to forward, up, right (textbook S
3.163, 3.165): heading clockwise from north, pitch up and roll right side down positive.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, Undetermined
from procedures.core.site import Site
from procedures.core.unit import Unit

LATITUDE_MAX_DEG = 89.0
"""At the poles the Earth turns about the vertical: no direction is north (textbook S 3.5). At 89° its horizontal part
is 1.7 %, so that a heading has sixty times the equator's uncertainty.
"""
PITCH_MAX_DEG = 85.0
"""Near the vertical heading and roll turn about one axis: their sum alone is determined."""


@dataclass(frozen=True)
class InitialAttitude:
    """Heading, pitch and roll with their covariance, and whether the measured magnitudes are likely."""

    angles_rad: Array
    """(heading, pitch, roll), shape (3,)."""
    covariance: Array
    """Covariance of the three angles, shape (3, 3)."""
    per_force: Array
    """∂(heading, pitch, roll)/∂(specific force) [rad/(m/s²)], shape (3, 3)."""
    per_rate: Array
    """∂(heading, pitch, roll)/∂(angular rate) [rad/(rad/s)], shape (3, 3)."""
    magnitude_errors: Array
    """|f| − g [m/s²], |ω| − Ω [rad/s], and the upward part of ω minus Ω·sin L [rad/s], shape (3,)."""
    magnitude_sd: Array
    """Expected standard deviations of the magnitude errors, shape (3,)."""


def rotation_nb(heading_rad: float, pitch_rad: float, roll_rad: float) -> Array:
    """Return ``rot_nb = R_y(−heading)·R_z(pitch)·R_x(roll)``, shape (3, 3), for angles in radians."""
    return Rotation.from_euler("YZX", [-heading_rad, pitch_rad, roll_rad]).as_matrix()


def require_alignable(latitude_deg: float) -> None:
    """Refuse a latitude at which no heading can be determined. Raises `BadParameter`."""
    if abs(latitude_deg) > LATITUDE_MAX_DEG:
        raise BadParameter(
            "latitude_deg",
            latitude_deg,
            f"within ±{LATITUDE_MAX_DEG:g}: at a pole the Earth's rate has no horizontal part and shows no north",
        )


def initial_attitude(
    force_b: Array, rate_b: Array, covariance: Array, latitude_deg: float, gravity_m_s2: float, earth_rate_rad_s: float
) -> InitialAttitude:
    """Attitude of a unit at rest from f (3,) [m/s²] and ω (3,) [rad/s]; `covariance` (6, 6) of f, then ω.

    ``pitch = atan2(f_x, √(f_y² + f_z²))``, ``roll = atan2(−f_z, f_y)``, and with the rate turned level,
    ``ω_l = R_z(pitch)·R_x(roll)·ω``, ``heading = atan2(−ω_lz, ω_lx)``. Textbook S 3.164 takes the arcsine of f_x/g
    and 3.166 the arccosine of one gyro's rate; those need the very magnitudes, lose the heading's sign and, near
    north and south, its precision. Raises `BadParameter` near a pole and `Undetermined` near the vertical.
    """
    require_alignable(latitude_deg)
    angles = _angles(force_b, rate_b)
    if abs(angles[1]) > PITCH_MAX_DEG * units.DEG:
        raise Undetermined(
            "the heading of a unit that stands on end", ("heading − roll",), 2, 3, 1.0 / float(np.cos(angles[1]))
        )
    steps = np.repeat([1e-6 * gravity_m_s2, 1e-6 * earth_rate_rad_s], 3)
    derivative = np.empty((3, 6))
    both = np.concatenate([force_b, rate_b])
    for k, step in enumerate(np.diag(steps)):
        ahead, behind = both + step, both - step
        change = _angles(ahead[:3], ahead[3:]) - _angles(behind[:3], behind[3:])
        derivative[:, k] = np.angle(np.exp(1j * change)) / (2.0 * steps[k])
    errors, of_magnitudes = _magnitudes(force_b, rate_b, latitude_deg, gravity_m_s2, earth_rate_rad_s)
    return InitialAttitude(
        angles,
        derivative @ covariance @ derivative.T,
        derivative[:, :3],
        derivative[:, 3:],
        errors,
        np.sqrt(np.einsum("ka,ab,kb->k", of_magnitudes, covariance, of_magnitudes)),
    )


def azimuth_error(
    latitude_deg: float,
    gravity_m_s2: float,
    accelerometer_bias_m_s2: float,
    gyro_bias_rad_s: float,
    random_walk_rad_sqrt_s: float,
    base_turn_rad: float,
    time_s: float,
    earth_rate_rad_s: float = units.EARTH_RATE,
) -> tuple[float, float]:
    """Azimuth error to expect of an alignment of `time_s` (thesis 1.1) [rad]: as printed, and as independent errors.

    ``δ = b_aE·tan L/g + (b_gE + R/√T + Δφ/T)/(Ω·cos L)``, with b the instabilities of the east biases, R the angle
    random walk and Δφ the turn of the base meanwhile. The sum of the magnitudes is an upper figure; the second is the
    root of the sum of their squares, as for independent standard uncertainties.
    """
    require_alignable(latitude_deg)
    latitude = latitude_deg * units.DEG
    across = earth_rate_rad_s * float(np.cos(latitude))
    parts = np.abs(
        [
            accelerometer_bias_m_s2 * float(np.tan(latitude)) / gravity_m_s2,
            gyro_bias_rad_s / across,
            random_walk_rad_sqrt_s / float(np.sqrt(time_s)) / across,
            base_turn_rad / time_s / across,
        ]
    )
    return float(parts.sum()), float(np.sqrt(np.sum(parts**2)))


@dataclass(frozen=True)
class ThesisPrediction:
    """Azimuth error of one alignment by thesis 1.1: in-run noise alone, no calibration, launch or table in it."""

    added_deg: float
    """Sum of the parts' magnitudes, as printed."""
    independent_deg: float
    """Root of the sum of their squares."""


def thesis_prediction(unit: Unit, site: Site, base_turn_arcsec: float, alignment_s: float) -> ThesisPrediction | None:
    """Return thesis 1.1 with the noisiest channel of each triad, since any may look east; None where noise is not
    known.
    """
    if unit.gyro is None or unit.accelerometer is None:
        return None
    added, independent = azimuth_error(
        site.latitude_deg,
        site.gravity_m_s2,
        max(n.bias_instability for n in unit.accelerometer.noise),
        max(n.bias_instability for n in unit.gyro.noise),
        max(n.random_walk for n in unit.gyro.noise),
        base_turn_arcsec * units.ARCSEC,
        alignment_s,
        site.earth_rate_rad_s,
    )
    return ThesisPrediction(added / units.DEG, independent / units.DEG)


def _angles(force: Array, rate: Array) -> Array:
    """Heading, pitch and roll of an attitude [rad]."""
    pitch = float(np.arctan2(force[0], np.hypot(force[1], force[2])))
    roll = float(np.arctan2(-force[2], force[1]))
    level = rotation_nb(0.0, pitch, roll) @ rate
    return np.array([np.arctan2(-level[2], level[0]), pitch, roll])


def _magnitudes(
    force: Array, rate: Array, latitude_deg: float, gravity: float, earth_rate: float
) -> tuple[Array, Array]:
    """Errors of |f|, |ω| and of ω's upward part (3,), and their derivatives by (f, ω), (3, 6)."""
    f, w = float(np.linalg.norm(force)), float(np.linalg.norm(rate))
    up, along = force / f, rate / w
    upward = float(up @ rate)
    none = np.zeros(3)
    derivative = np.array(
        [
            np.concatenate([up, none]),
            np.concatenate([none, along]),
            np.concatenate([(rate - upward * up) / f, up]),
        ]
    )
    expected_up = earth_rate * float(np.sin(latitude_deg * units.DEG))
    return np.array([f - gravity, w - earth_rate, upward - expected_up]), derivative
