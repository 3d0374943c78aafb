"""The free-inertial mechanisation against closed forms and against the linear error equations, unused by it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from procedures.analysis.navigation.alignment import initial_attitude, rotation_nb
from procedures.analysis.navigation.error_growth import Alignment, constant_error
from procedures.analysis.navigation.error_model import HEADING, TILT_EAST, TILT_NORTH, V_EAST, V_NORTH, Place, responses
from procedures.analysis.navigation.free_inertial import Track, free_inertial
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording

PLACE = Place(50.0 * units.DEG, 9.81)
ATTITUDE = rotation_nb(0.7, 0.1, -0.2)
HOURS = 3.0


def at_rest(error_b: Array, hours: float = HOURS, step_s: float = 2.0) -> tuple[Array, Array]:
    """Rates and forces of a unit at rest with constant errors (6,) in its own axes."""
    latitude = PLACE.latitude_rad
    rate = ATTITUDE.T @ (PLACE.earth_rate_rad_s * np.array([np.cos(latitude), np.sin(latitude), 0.0]))
    force = ATTITUDE.T @ np.array([0.0, PLACE.gravity_m_s2, 0.0])
    n = round(hours * 3600.0 / step_s)
    return np.tile(rate + error_b[:3], (n, 1)), np.tile(force + error_b[3:], (n, 1))


def run(error_b: Array, attitude: Array = ATTITUDE, hours: float = HOURS, step_s: float = 2.0) -> Track:
    return free_inertial(PLACE, attitude, *at_rest(error_b, hours, step_s), step_s)


def final(track: Track) -> Array:
    return np.array([track.north_m[-1], track.east_m[-1], track.velocity_north_m_s[-1], track.velocity_east_m_s[-1]])


def test_a_perfect_unit_stays_where_it_is() -> None:
    """Rounding alone: 1e-16 of g for hours under Schuler's loop is far below a micrometre; a millimetre is asked."""
    track = run(np.zeros(6))
    assert np.max(track.radial_m) < 1e-3
    np.testing.assert_allclose(track.attitude_nb, ATTITUDE, atol=1e-9)


@pytest.mark.parametrize("state", range(6))
def test_constant_errors_grow_as_the_linear_equations_say(state: int) -> None:
    """Errors small enough that squares do not count: 0.01 deg/h and 10 µg. The step's own error falls with its square
    (measured below); 0.2 % of the largest component is asked at 2 s steps.
    """
    error = np.zeros(6)
    error[state] = 0.01 * units.DEG_PER_HOUR if state < 3 else 10.0 * units.MICRO_G
    expected = constant_error(PLACE, Alignment(None), np.kron(np.eye(2), ATTITUDE) @ error, HOURS * 3600.0)
    wanted = np.array([*(PLACE.metres @ expected), expected[V_NORTH], expected[V_EAST]])
    found = final(run(error))
    np.testing.assert_allclose(found[:2], wanted[:2], atol=2e-3 * np.abs(wanted[:2]).max())
    np.testing.assert_allclose(found[2:], wanted[2:], atol=2e-3 * np.abs(wanted[2:]).max())


def test_an_attitude_error_grows_as_the_linear_equations_say() -> None:
    """ε = (χ, α, β) turns what the navigator computes: ``ñ = n − ε × n``, so its rot_nb is R(−ε)·C."""
    tilt = np.array([5.0, 60.0, -8.0]) * units.ARCSEC
    start = np.zeros(9)
    start[[TILT_NORTH, HEADING, TILT_EAST]] = tilt
    expected = responses(PLACE, HOURS * 3600.0, 1).transition[-1] @ start
    found = final(run(np.zeros(6), Rotation.from_rotvec(-tilt).as_matrix() @ ATTITUDE))
    wanted = PLACE.metres @ expected
    np.testing.assert_allclose(found[:2], wanted, atol=2e-3 * np.abs(wanted).max())


def test_a_self_aligned_navigator_drifts_as_the_linear_equations_say() -> None:
    """Alignment and navigation with the same errors, the former by `initial_attitude`, which is nonlinear too."""
    error = np.array([0.01, -0.02, 0.015, 0.0, 0.0, 0.0]) * units.DEG_PER_HOUR
    error[3:] = np.array([20.0, -10.0, 15.0]) * units.MICRO_G
    rates, forces = at_rest(error)
    covariance = np.eye(6)
    aligned = initial_attitude(forces[0], rates[0], covariance, 50.0, PLACE.gravity_m_s2, PLACE.earth_rate_rad_s)
    attitude = rotation_nb(*aligned.angles_rad)
    inputs = np.kron(np.eye(2), ATTITUDE) @ error
    expected = PLACE.metres @ constant_error(PLACE, Alignment(600.0), inputs, HOURS * 3600.0)
    found = final(run(error, attitude))
    np.testing.assert_allclose(found[:2], expected, atol=1e-2 * np.abs(expected).max())


def test_the_error_of_a_step_falls_with_its_square() -> None:
    error = np.array([0.01 * units.DEG_PER_HOUR, 0.0, 0.0, 0.0, 0.0, 0.0])
    fine, middle, coarse = (final(run(error, hours=1.0, step_s=s))[:2] for s in (1.0, 4.0, 16.0))
    assert np.linalg.norm(coarse - fine) < 1e-3 * np.linalg.norm(fine)
    assert np.linalg.norm(middle - fine) < np.linalg.norm(coarse - fine) / 3.0


def test_a_solution_that_diverges_is_said() -> None:
    with pytest.raises(UnfitRecording, match="it diverges"):
        run(np.array([0.0, 0.0, 0.0, 5.0, 0.0, 0.0]), hours=2.0)
