"""Free-inertial navigation of a recorded unit: attitude, velocity and position from its own increments alone.

The mechanisation is nonlinear and shares no equation with the linear `error_model` that predicts its errors, but for
the sphere that both navigate on (textbook S 4.1). Frame n: north, up, east; height and vertical velocity are held.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from procedures.analysis.navigation.error_model import LATITUDE_MAX_DEG, Place
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording

SPEED_MAX_M_S = 1000.0
"""Speed beyond which the solution of a parked unit has diverged."""


@dataclass(frozen=True)
class Track:
    """Course of a navigator that in truth did not move; arrays (n + 1,) from the start on."""

    time_s: Array
    north_m: Array
    """Distance from the start towards north, on the sphere."""
    east_m: Array
    velocity_north_m_s: Array
    velocity_east_m_s: Array
    attitude_nb: Array
    """Attitude at the end, rot_nb, shape (3, 3)."""

    @property
    def radial_m(self) -> Array:
        """Horizontal distance from the start, (n + 1,)."""
        return np.hypot(self.north_m, self.east_m)


def free_inertial(place: Place, attitude_nb: Array, rates_b: Array, forces_b: Array, step_s: float) -> Track:
    """Navigate from rest at `place` with mean rates (n, 3) [rad/s] and specific forces (n, 3) [m/s²] of even steps.

    Over a step of Δt: ``C ← R(−(ω_ie + ω_en)Δt)·C·R(ω_b Δt)``; ``v ← v + (C_mid·f_b + g − (2ω_ie + ω_en) × v)Δt`` with
    C_mid the attitude in the middle of the step; latitude and longitude by the mean velocity of the step. Steps must be
    short against changes of the attitude: a parked unit's of a second turn by 15″, and the neglected commutation by
    parts in 10⁸ of that. Raises `UnfitRecording` where the solution leaves the sphere's useful part: it diverged.
    """
    c, latitude, longitude = np.array(attitude_nb), place.latitude_rad, 0.0
    gravity = np.array([0.0, -place.gravity_m_s2, 0.0])
    v, change = np.zeros(3), np.zeros(3)
    turns = Rotation.from_rotvec(rates_b * step_s).as_matrix()
    halves = Rotation.from_rotvec(rates_b * (0.5 * step_s)).as_matrix()
    rows = np.zeros((len(rates_b) + 1, 4))
    for k in range(len(rates_b)):
        middle = v + 0.5 * change  # velocity in the middle of the step, by the change over the last one
        earth = place.earth_rate_rad_s * np.array([np.cos(latitude), np.sin(latitude), 0.0])
        transport = _transport(place.radius_m, latitude, middle)
        half = Rotation.from_rotvec(-0.5 * step_s * (earth + transport)).as_matrix()
        change = (half @ c @ halves[k] @ forces_b[k] + gravity - np.cross(2.0 * earth + transport, middle)) * step_s
        change[1] = 0.0  # held
        c = half @ half @ c @ turns[k]
        mean, v = v + 0.5 * change, v + change
        latitude += mean[0] * step_s / place.radius_m
        if not abs(latitude) < LATITUDE_MAX_DEG * units.DEG or float(np.hypot(v[0], v[2])) > SPEED_MAX_M_S:
            raise UnfitRecording(
                f"the free-inertial solution is at {np.hypot(v[0], v[2]):.0f} m/s and latitude "
                f"{latitude / units.DEG:.1f}° after {(k + 1) * step_s:g} s: it diverges, the unit moved or its "
                "calibration is not its own"
            )
        longitude += mean[2] * step_s / (place.radius_m * np.cos(latitude))
        rows[k + 1] = (latitude - place.latitude_rad, longitude, v[0], v[2])
    return Track(
        np.arange(len(rows), dtype=np.float64) * step_s,
        rows[:, 0] * place.radius_m,
        rows[:, 1] * place.radius_m * float(np.cos(place.latitude_rad)),
        rows[:, 2],
        rows[:, 3],
        c,
    )


def _transport(radius_m: float, latitude: float, velocity: Array) -> Array:
    """Turn of the local frame by the motion over the sphere, north, up, east [rad/s]."""
    return np.array([velocity[2], velocity[2] * np.tan(latitude), -velocity[0]]) / radius_m
