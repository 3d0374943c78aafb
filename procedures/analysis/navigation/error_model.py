"""Linear error equations of a strapdown navigator that does not move (textbook S 4.119 with zero velocity).

Frame: north, up, east, a spherical Earth as in S. The attitude error ε = (χ, α, β) is the turn by which the vectors
that the navigator computes differ from the true ones, ``ñ = n − ε × n`` (textbook S 4.100-4.102): χ about north, α
about up, β about east. With the heading clockwise, ``heading computed − true = α`` (textbook S 4.140, whose yaw is
counterclockwise, has −α); a level unit heading north has a pitch error of −β and a roll error of −χ.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter

STATES = ("tilt north", "heading", "tilt east", "v north", "v up", "v east", "latitude", "longitude", "height")
"""Order of all states, for readers and tests: χ, α, β [rad], velocity errors [m/s], errors of latitude
and longitude [rad] and height [m]."""
TILT_NORTH, HEADING, TILT_EAST, V_NORTH, V_UP, V_EAST, LATITUDE, LONGITUDE, HEIGHT = range(9)

EARTH_RADIUS_M = 6_371_000.0
"""Sphere's radius (textbook S 4.1): with g = 9.81 m/s² the Schuler period is 84.4 min. The ellipsoid's radii of
curvature differ from it by up to 0.6 %, and the result as much."""

LATITUDE_MAX_DEG = 89.0
"""Greatest latitude: nearer to a pole longitude and heading degenerate, as the equations divide by cos L."""


@dataclass(frozen=True)
class Place:
    """Place of the navigator, as far as it affects the errors."""

    latitude_rad: float
    gravity_m_s2: float
    earth_rate_rad_s: float = units.EARTH_RATE
    radius_m: float = EARTH_RADIUS_M
    vertical: str = "held"
    """"held": height and vertical velocity come from an altimeter and have no error; "free": they grow without bound,
    by e in √(R/2g), ten minutes."""

    def __post_init__(self) -> None:
        if abs(self.latitude_rad) > LATITUDE_MAX_DEG * units.DEG:
            allowed = f"within ±{LATITUDE_MAX_DEG:g}: near a pole longitude and heading have no use"
            raise BadParameter("latitude_deg", self.latitude_rad / units.DEG, allowed)

    @property
    def schuler_rad_s(self) -> float:
        """Schuler frequency ``ω₀ = √(g/R)`` (textbook S 4.10)."""
        return float(np.sqrt(self.gravity_m_s2 / self.radius_m))

    @property
    def horizontal_rate_rad_s(self) -> float:
        """Horizontal Earth rate ``Ω·cos L``, the input of a gyrocompass."""
        return self.earth_rate_rad_s * float(np.cos(self.latitude_rad))

    @property
    def metres(self) -> Array:
        """Metres north and east per unit of each state, shape (2, 9)."""
        scale = np.zeros((2, 9))
        scale[0, LATITUDE] = self.radius_m
        scale[1, LONGITUDE] = self.radius_m * np.cos(self.latitude_rad)
        return scale


def dynamics(place: Place) -> tuple[Array, Array]:
    """``ẋ = F·x + B·u``: F (9, 9) over `STATES`, B (9, 6) over gyro errors [rad/s] and accelerometer errors [m/s²].

    u has measured − true along north, up, east: three gyros, then three accelerometers. Textbook S 4.119 with V = 0:
    ``χ̇ = −β·Ω sin φ + ΔV_E/R − Ω sin φ·Δφ − e_N``, ``α̇ = β·Ω cos φ + Ω cos φ·Δφ + ΔV_E·tan φ/R − e_U``,
    ``β̇ = χ·Ω sin φ − α·Ω cos φ − ΔV_N/R − e_E``, ``ΔV̇_N = g·β − 2Ω sin φ·ΔV_E + a_N``,
    ``ΔV̇_E = −g·χ + 2Ω sin φ·ΔV_N − 2Ω cos φ·ΔV_U + a_E``, ``ΔV̇_U = 2Ω cos φ·ΔV_E + 2g/R·Δh + a_U``,
    ``Δφ̇ = ΔV_N/R``, ``Δλ̇ = ΔV_E/(R cos φ)``, ``Δḣ = ΔV_U``.
    """
    north = place.horizontal_rate_rad_s
    up = place.earth_rate_rad_s * float(np.sin(place.latitude_rad))
    tangent, cosine = float(np.tan(place.latitude_rad)), float(np.cos(place.latitude_rad))
    g, radius = place.gravity_m_s2, place.radius_m
    f, b = np.zeros((9, 9)), np.zeros((9, 6))
    f[TILT_NORTH, [TILT_EAST, V_EAST, LATITUDE]] = -up, 1.0 / radius, -up
    f[HEADING, [TILT_EAST, V_EAST, LATITUDE]] = north, tangent / radius, north
    f[TILT_EAST, [TILT_NORTH, HEADING, V_NORTH]] = up, -north, -1.0 / radius
    f[V_NORTH, [TILT_EAST, V_EAST]] = g, -2.0 * up
    f[V_EAST, [TILT_NORTH, V_NORTH, V_UP]] = -g, 2.0 * up, -2.0 * north
    f[V_UP, [V_EAST, HEIGHT]] = 2.0 * north, 2.0 * g / radius
    f[LATITUDE, V_NORTH], f[LONGITUDE, V_EAST], f[HEIGHT, V_UP] = 1.0 / radius, 1.0 / (radius * cosine), 1.0
    b[[TILT_NORTH, HEADING, TILT_EAST], [0, 1, 2]] = -1.0
    b[[V_NORTH, V_UP, V_EAST], [3, 4, 5]] = 1.0
    if place.vertical == "held":
        for state in (V_UP, HEIGHT):
            f[state], f[:, state], b[state] = 0.0, 0.0, 0.0
    return f, b


@dataclass(frozen=True)
class Responses:
    """Responses of the navigator to inputs, on an even grid of n + 1 times from zero on."""

    step_s: float
    transition: Array
    """Φ(t): errors at t per initial error, shape (n + 1, 9, 9)."""
    of_cell: Array
    """Errors after j + 1 steps per input applied in the first step alone, shape (n, 9, 6)."""

    @property
    def of_constant(self) -> Array:
        """Errors at each time of the grid per input that has been constant since zero, shape (n + 1, 9 states, 6
        inputs).
        """
        return np.concatenate([np.zeros((1, 9, 6)), np.cumsum(self.of_cell, axis=0)])


def responses(place: Place, duration_s: float, steps: int) -> Responses:
    """Return the responses over `duration_s` in `steps`, exact for an input constant in each step: ``exp([F B; 0
    0]·Δt)`` (Van Loan 1978).
    """
    f, b = dynamics(place)
    step = duration_s / steps
    whole = expm(np.block([[f, b], [np.zeros((6, 15))]]) * step)
    transition = np.empty((steps + 1, 9, 9))
    transition[0] = np.eye(9)
    for k in range(steps):
        transition[k + 1] = whole[:9, :9] @ transition[k]
    return Responses(step, transition, transition[:-1] @ whole[:9, 9:])


def self_alignment(place: Place) -> Array:
    """Initial errors per sensor error where the navigator aligned itself at this very place, shape (9, 6).

    Levelling puts the measured specific force upright, gyrocompassing the measured rate to the north (textbook S
    3.163-3.166): ``β₀ = −a_N/g``, ``χ₀ = a_E/g``, ``α₀ = (χ₀·Ω sin φ − e_E)/(Ω cos φ)``: the error of thesis 1.1.
    Accelerometers with constant errors leave such a navigator almost at rest: an east one entirely, a north one
    except for a drift of ``a_N/g·Ω``, since its tilt acts as an error of latitude.
    """
    initial = np.zeros((9, 6))
    initial[TILT_EAST, 3] = -1.0 / place.gravity_m_s2
    initial[TILT_NORTH, 5] = 1.0 / place.gravity_m_s2
    initial[HEADING, 5] = float(np.tan(place.latitude_rad)) / place.gravity_m_s2
    initial[HEADING, 2] = -1.0 / place.horizontal_rate_rad_s
    return initial
