"""Error growth against the closed forms of textbook S 4.1, a nonlinear navigator, and integrals of white noise."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from procedures.analysis.navigation.error_growth import Alignment, error_growth, radius_containing
from procedures.analysis.navigation.error_model import (
    HEADING,
    LATITUDE,
    LONGITUDE,
    STATES,
    TILT_EAST,
    TILT_NORTH,
    V_NORTH,
    Place,
    responses,
    self_alignment,
)
from procedures.analysis.navigation.instrument_errors import TriadErrors, calibrated_triad, declared_triad
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.imu_model import triad_calibration
from procedures.core.noise import NoiseCoefficients

LATITUDE_RAD = np.radians(50.45)
G, R = 9.81, 6_371_000.0
HOURS_3 = 3.0 * 3600.0
KYIV = Place(LATITUDE_RAD, G)
STILL_EARTH = Place(0.0, G, earth_rate_rad_s=0.0)
NONE = TriadErrors({})


def trajectory(place: Place, initial: np.ndarray, inputs: np.ndarray, steps: int = 180) -> np.ndarray:
    grid = responses(place, HOURS_3, steps)
    return grid.transition @ initial + grid.of_constant @ inputs


def state(name: int, value: float) -> np.ndarray:
    return np.where(np.arange(len(STATES)) == name, value, 0.0)


def sensor(column: int, value: float) -> np.ndarray:
    return np.where(np.arange(6) == column, value, 0.0)


def within_a_thousandth(found: np.ndarray, expected: np.ndarray) -> None:
    assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()


def test_the_schuler_period_is_84_minutes():
    assert 2 * np.pi / KYIV.schuler_rad_s / 60 == pytest.approx(84.4, abs=0.05)  # textbook S 4.1


def test_a_wrong_vertical_swings_as_s_4_11_to_4_15():
    t, w, tilt = np.linspace(0, HOURS_3, 181), STILL_EARTH.schuler_rad_s, 1e-4
    north = trajectory(STILL_EARTH, state(TILT_EAST, tilt), np.zeros(6))
    within_a_thousandth(north[:, TILT_EAST], tilt * np.cos(w * t))
    within_a_thousandth(north[:, V_NORTH], G * tilt / w * np.sin(w * t))
    within_a_thousandth(R * north[:, LATITUDE], tilt * R * (1 - np.cos(w * t)))


def test_an_accelerometer_bias_acts_as_s_4_22_to_4_25():
    t, w, a = np.linspace(0, HOURS_3, 181), STILL_EARTH.schuler_rad_s, 1e-3
    north = trajectory(STILL_EARTH, np.zeros(9), sensor(3, a))
    within_a_thousandth(north[:, TILT_EAST], a / G * (np.cos(w * t) - 1))
    within_a_thousandth(north[:, V_NORTH], a / w * np.sin(w * t))
    within_a_thousandth(R * north[:, LATITUDE], a / w**2 * (1 - np.cos(w * t)))


def test_a_gyro_drift_acts_as_s_4_36_to_4_39():
    t, w, e = np.linspace(0, HOURS_3, 181), STILL_EARTH.schuler_rad_s, 0.01 * units.DEG_PER_HOUR
    north = trajectory(STILL_EARTH, np.zeros(9), sensor(2, e))
    within_a_thousandth(north[:, TILT_EAST], -e / w * np.sin(w * t))
    within_a_thousandth(north[:, V_NORTH], e * R * (np.cos(w * t) - 1))
    within_a_thousandth(R * north[:, LATITUDE], e * R / w * (np.sin(w * t) - w * t))


def test_the_east_channel_at_the_equator_acts_as_s_4_126_to_4_128():
    t, w, place = np.linspace(0, HOURS_3, 181), STILL_EARTH.schuler_rad_s, STILL_EARTH
    tilt, a, e = 1e-4, 1e-3, 0.01 * units.DEG_PER_HOUR
    found = trajectory(place, state(TILT_NORTH, tilt), sensor(5, a) + sensor(0, e))
    chi = tilt * np.cos(w * t) + a / G * (1 - np.cos(w * t)) - e / w * np.sin(w * t)
    within_a_thousandth(found[:, TILT_NORTH], chi)
    longitude = (tilt - a / G) * (np.cos(w * t) - 1) + e / w * (w * t - np.sin(w * t))
    within_a_thousandth(found[:, LONGITUDE], longitude)


def nonlinear(place: Place, attitude: np.ndarray, errors: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    """A strapdown navigator on a sphere, written out: attitude matrix, velocity, place. Returns (181, 15).

    North, up, east; the unit stands still at zero velocity. `errors` is the first attitude error in the sense of
    ``ñ = n − ε × n``, `wrong` the six sensor errors in the unit's axes (here: level axes turned by `attitude`).
    """
    free = place.vertical == "free"
    rate_n = place.earth_rate_rad_s * np.array([np.cos(LATITUDE_RAD), np.sin(LATITUDE_RAD), 0.0])
    rate_b = attitude.T @ (rate_n + wrong[:3])
    force_b = attitude.T @ (np.array([0.0, G, 0.0]) + wrong[3:])

    def cross(v: np.ndarray) -> np.ndarray:
        return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])

    def derivative(_: float, y: np.ndarray) -> np.ndarray:
        c, v, (latitude, _lon, height) = y[:9].reshape(3, 3), y[9:12], y[12:]
        radius = R + (height if free else 0.0)
        earth = place.earth_rate_rad_s * np.array([np.cos(latitude), np.sin(latitude), 0.0])
        over = np.array([v[2] / radius, v[2] * np.tan(latitude) / radius, -v[0] / radius])
        gravity = np.array([0.0, -G * (R / radius) ** 2, 0.0])
        dv = c @ force_b + gravity - np.cross(2 * earth + over, v)
        if not free:
            dv[1] = 0.0
        dc = c @ cross(rate_b) - cross(earth + over) @ c
        place_dot = np.array([v[0] / radius, v[2] / (radius * np.cos(latitude)), v[1]])
        return np.concatenate([dc.ravel(), dv, place_dot])

    start = Rotation.from_rotvec(-errors).as_matrix() @ attitude
    y0 = np.concatenate([start.ravel(), np.zeros(3), [LATITUDE_RAD, 0.0, 0.0]])
    duration = 1800.0 if free else HOURS_3
    times = np.linspace(0, duration, 181)
    return solve_ivp(derivative, (0, duration), y0, "DOP853", times, rtol=1e-12, atol=1e-15).y.T


@pytest.mark.parametrize("vertical", ["held", "free"])
def test_the_full_equations_agree_with_a_nonlinear_navigator(vertical: str):
    place = Place(LATITUDE_RAD, G, vertical=vertical)
    attitude = Rotation.from_euler("YZX", [-37.0, 4.0, -7.0], degrees=True).as_matrix()
    tilt = np.array([1.0, -3.0, 2.0]) * 1e-6
    wrong = np.array([*(np.array([1.0, -2.0, 1.5]) * 1e-3 * units.DEG_PER_HOUR), 3e-6, 4e-6, -2e-6])
    truth = nonlinear(place, attitude, np.zeros(3), np.zeros(6))
    moved = nonlinear(place, attitude, tilt, wrong) - truth
    duration = 1800.0 if vertical == "free" else HOURS_3
    grid = responses(place, duration, 180)
    linear = grid.transition @ np.concatenate([tilt, np.zeros(6)]) + grid.of_constant @ wrong
    for found, expected in (
        (linear[:, 3:6], moved[:, 9:12]),
        (linear[:, 6:], moved[:, 12:]),
    ):
        for k in range(3):
            if np.any(expected[:, k]):
                within_a_thousandth(found[:, k], expected[:, k])
    # ñ = n − ε × n, so the computed attitude is C̃ = (1 − [ε×])·C.
    computed = moved[:, :9].reshape(-1, 3, 3) @ attitude.T
    angles = -np.stack([computed[:, 2, 1], computed[:, 0, 2], computed[:, 1, 0]], axis=1)
    for k in range(3):
        within_a_thousandth(linear[:, k], angles[:, k])


def test_a_navigator_that_aligned_itself_with_a_biased_east_accelerometer_stays_where_it_is():
    grid = responses(KYIV, HOURS_3, 60)
    biases = sensor(5, -2e-3)
    moved = grid.transition @ self_alignment(KYIV) @ biases + grid.of_constant @ biases
    # To be compared with −2e-3 m/s² · 81 km/(m/s²) = 163 m of swing without alignment; 1e-9 m is rounding.
    assert R * np.abs(moved[:, [LATITUDE, LONGITUDE]]).max() < 1e-6
    # A tilt of a/g about east mistakes the latitude by as much, and the Earth's rate drives it off: a drift of a/g·Ω.
    tilted = grid.transition @ self_alignment(KYIV) @ sensor(3, 2e-3) + grid.of_constant @ sensor(3, 2e-3)
    drift = sensor(0, -2e-3 / G * KYIV.earth_rate_rad_s * np.sin(LATITUDE_RAD))
    drift -= sensor(1, -2e-3 / G * KYIV.horizontal_rate_rad_s)
    within_a_thousandth(tilted[:, LONGITUDE], (grid.of_constant @ drift)[:, LONGITUDE])
    east = self_alignment(KYIV) @ sensor(2, 0.01 * units.DEG_PER_HOUR)
    # The rule of thumb of gyrocompassing: 0.01 deg/h across Ω·cos L.
    assert -east[HEADING] == pytest.approx(0.01 / (15.041067 * np.cos(LATITUDE_RAD)), rel=1e-6)


def test_white_noise_grows_as_its_integral():
    """Angle random walk through textbook S 4.39: the position's answer to a pulse is ``R·(cos ω₀t − 1)``."""
    n, w = 0.002 * units.DEG_PER_SQRT_HOUR, STILL_EARTH.schuler_rad_s
    noise = TriadErrors({}, (NoiseCoefficients(random_walk=n),) * 3)
    growth = error_growth(STILL_EARTH, np.eye(3), noise, NONE, Alignment(), HOURS_3)
    variance = n**2 * R**2 * quad(lambda s: (np.cos(w * s) - 1) ** 2, 0, HOURS_3)[0]
    assert R**2 * growth.total[-1, LATITUDE, LATITUDE] == pytest.approx(variance, rel=2e-3)
    velocity = TriadErrors({}, (NoiseCoefficients(random_walk=1e-4),) * 3)
    growth = error_growth(STILL_EARTH, np.eye(3), NONE, velocity, Alignment(), HOURS_3)
    variance = 1e-8 / w**2 * quad(lambda s: np.sin(w * s) ** 2, 0, HOURS_3)[0]
    # A cell of 45 s takes (ω₀Δt)²/12 = 0.03 % off.
    assert R**2 * growth.total[-1, LATITUDE, LATITUDE] == pytest.approx(variance, rel=2e-3)


def test_flicker_that_hardly_changes_is_a_constant():
    band = (1e7, 1e9)
    slow = NoiseCoefficients(bias_instability=0.01 * units.DEG_PER_HOUR, flicker_band_s=band)
    sd = slow.bias_instability * np.sqrt(np.log(band[1] / band[0]) / np.pi)
    aligned = Alignment(duration_s=600.0)
    noisy = error_growth(KYIV, np.eye(3), TriadErrors({}, (slow,) * 3), NONE, aligned, 3600.0)
    constant = error_growth(KYIV, np.eye(3), TriadErrors({"b": np.eye(3) * sd**2}), NONE, aligned, 3600.0)
    # Over 4200 s processes of 10⁷ … 10⁹ s lose 0.04 % of their correlation, of which the difference between
    # alignment and navigation shows the tenfold.
    found, expected = np.sqrt(np.diagonal(noisy.total[-1])), np.sqrt(np.diagonal(constant.total[-1]))
    assert found[expected > 0] == pytest.approx(expected[expected > 0], rel=4e-3)


def test_a_calibration_becomes_the_error_that_its_covariance_says():
    rng = np.random.default_rng(5)
    matrix = np.array([[0.81, 0.01, -0.02], [0.0, 0.86, -0.006], [0.001, 0.005, 0.85]])
    root = rng.normal(size=(12, 12)) * 1e-6
    coefficients = np.column_stack([[0.09, 0.09, 0.12], matrix]).ravel()
    calibration = triad_calibration("accelerometer", "m/s^2", "m/s^2", coefficients, root @ root.T)
    v = np.array([0.7, 9.7, -0.6])
    claimed = calibrated_triad(calibration, None, v).constant["calibration"]
    drawn = coefficients[:, None] + root @ rng.normal(size=(12, 4000))
    output = np.array([0.09, 0.09, 0.12]) + matrix @ v
    errors = np.array([np.linalg.solve(d[:, 1:], output - d[:, 0]) for d in drawn.T.reshape(-1, 3, 4)]) - v
    # Sample standard deviations of 4000: one part in √8000, four of them allowed.
    assert errors.std(axis=0) == pytest.approx(np.sqrt(np.diagonal(claimed)), rel=4 / np.sqrt(8000))


def test_declared_uncertainties_add_as_they_should():
    v = np.array([0.0, 9.8, 0.0])
    errors = declared_triad(1e-4, 1e-4, 1e-5, NoiseCoefficients(), v)
    variance = np.diagonal(errors.constant["given"])
    assert variance == pytest.approx([1e-8 + 9.8e-5**2, 1e-8 + 9.8e-4**2, 1e-8 + 9.8e-5**2])


@pytest.mark.parametrize("ratio", [1.0, 0.5, 0.1, 0.0])
def test_the_radius_that_holds_a_part_of_a_gaussian(ratio: float):
    covariance = 25.0 * np.array([[1.0, 0.0], [0.0, ratio**2]])
    radius = radius_containing(0.95, covariance)
    if ratio == 1.0:
        assert radius == pytest.approx(5.0 * np.sqrt(chi2.ppf(0.95, 2)), rel=1e-6)
    elif ratio == 0.0:
        assert radius == pytest.approx(5.0 * 1.959964, rel=1e-4)
    else:  # P(|x| < r) of two independent normals, x outside, y by chi-square with one degree of freedom
        inside = quad(
            lambda x: np.exp(-x * x / 50) / np.sqrt(50 * np.pi) * chi2.cdf((radius**2 - x * x) / (5.0 * ratio) ** 2, 1),
            -radius,
            radius,
            epsabs=1e-10,
        )[0]
        assert inside == pytest.approx(0.95, abs=1e-6)


def test_a_pole_is_refused():
    with pytest.raises(BadParameter, match="latitude_deg"):
        Place(np.radians(89.5), G)
