"""Nine parameters from magnitudes: rank before the solve, large scale errors, counts, honest uncertainty."""

import numpy as np
import pytest
from scipy.linalg import rq

from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.scalar import (
    fit_scalar,
    linear_coefficients,
    nominal_start,
    require_scalar_determined,
    scalar_parameters,
    start_from_data,
)
from procedures.analysis.least_squares.ellipsoid import ellipsoid
from procedures.core.errors import Undetermined
from procedures.core.frames import orientation_beta_gamma, orientation_gamma_beta
from procedures.core.table_angles import TableAngles
from tests.kit.forward_model import B_ACCELEROMETER, BETA_GAMMA, K_ACCELEROMETER, SITE

G = SITE.gravity_m_s2
ANGLES = [orientation_beta_gamma(b, g) for b, g in BETA_GAMMA]
VECTORS = reference_vectors("accelerometer", ANGLES, SITE)
MEANS = B_ACCELEROMETER + VECTORS @ K_ACCELEROMETER.T
TRUTH = scalar_parameters(np.column_stack([B_ACCELEROMETER, K_ACCELEROMETER]).ravel())


def test_the_ellipsoid_through_points_of_one_is_that_one() -> None:
    """Twelve directions on |R·(u − c)| = 1; rounding of the squares of numbers of 1e4, and no more."""
    centre = np.array([300.0, -2000.0, 9000.0])
    upper = np.array([[1.0, 0.03, -0.02], [0.0, 1.1, 0.04], [0.0, 0.0, 0.9]]) / 16_000.0
    directions = VECTORS / np.linalg.norm(VECTORS, axis=1)[:, None]
    about_zero = np.linalg.solve(upper, directions.T).T
    found = ellipsoid(about_zero + centre)
    assert found is not None
    np.testing.assert_allclose(found[0], centre, rtol=1e-9)
    np.testing.assert_allclose(found[1], upper, rtol=0.0, atol=1e-9 / 16_000.0)
    assert ellipsoid(about_zero + 5.0 * centre) is None, "the origin is outside"
    x, y, z = directions.T
    assert ellipsoid(np.column_stack([x, y, np.sqrt(1.0 + x * x + y * y) * np.sign(z + 0.5)])) is None, "two sheets"
    assert ellipsoid(np.zeros((9, 3))) is None


def white(sd: float, n: int = 12) -> np.ndarray:
    return np.array([np.eye(n) * sd**2] * 3)


def test_the_twelve_orientations_determine_all_nine():
    # With columns scaled to unit length √6; without, 4.6 (methods, errata: 5).
    assert require_scalar_determined("it", VECTORS / G) == pytest.approx(np.sqrt(6.0))


def test_the_other_rotation_order_loses_one_and_says_which():
    angles = [orientation_gamma_beta(b, g) for b, g in BETA_GAMMA]
    with pytest.raises(Undetermined, match=r"rank 8 of 9.*misalignment difference x–z \(δ_zy − δ_xy\)$") as refusal:
        require_scalar_determined("it", reference_vectors("accelerometer", angles, SITE) / G)
    assert len(refusal.value.lost) == 1


def test_the_nine_orientation_set_is_determined_but_poor():
    angles = [TableAngles(20.0 * i, 10.0 * i, 40.0 * i) for i in range(9)]
    condition = require_scalar_determined("it", reference_vectors("accelerometer", angles, SITE) / G)
    assert 5e3 < condition < 1e4  # methods, errata: 7·10³


def test_combinations_are_named_when_no_single_one_is_lost():
    turning = np.array([[np.cos(a), np.sin(a), 0.0] for a in np.linspace(0, 2 * np.pi, 12, endpoint=False)])
    with pytest.raises(Undetermined) as refusal:
        require_scalar_determined("it", turning)
    assert refusal.value.rank == 5
    assert {"bias z", "scale factor z"} <= set(refusal.value.lost)


def test_eighteen_percent_scale_errors_and_cross_couplings_come_back_exactly():
    fit = fit_scalar("it", MEANS, white(1e-5), G, nominal_start())
    assert fit.parameters == pytest.approx(TRUTH, rel=1e-10, abs=1e-11)
    assert fit.residuals == pytest.approx(np.zeros(12), abs=1e-10)


def test_what_a_linear_calibration_implies_is_its_upper_triangular_part():
    upper, _ = rq(K_ACCELEROMETER)
    upper = upper * np.sign(np.diagonal(upper))
    assert linear_coefficients(TRUTH).reshape(3, 4)[:, 1:] == pytest.approx(upper)


def test_counts_of_unknown_scale():
    counts = 32768.0 + MEANS / 0.0024
    fit = fit_scalar("it", counts, white(0.01), G, start_from_data(counts, G))
    assert fit.parameters[3:6] == pytest.approx(TRUTH[3:6] * 0.0024, rel=1e-9)
    assert fit.parameters[:3] == pytest.approx(32768.0 + TRUTH[:3] / 0.0024, rel=1e-9)
    calibration = fit.calibration("accelerometer", "count", "m/s^2")
    assert np.tril(calibration.matrix_array, -1) == pytest.approx(np.zeros((3, 3)))
    # Relative to its value the scale's uncertainty is the same whether told in SI per count or counts per SI.
    relative = calibration.standard_uncertainties[[1, 6, 11]] / np.diagonal(calibration.matrix_array)
    assert relative == pytest.approx(fit.standard_uncertainties[3:6] / fit.parameters[3:6], rel=0.02)


def test_errors_have_the_spread_that_is_claimed():
    rng, n, sd = np.random.default_rng(3), 200, 2e-3
    fits = [fit_scalar("it", MEANS + sd * rng.normal(size=(12, 3)), white(sd), G, nominal_start()) for _ in range(n)]
    errors = np.array([f.parameters for f in fits]) - TRUTH
    covariance = fits[0].covariance
    assert np.abs(errors.mean(axis=0) / fits[0].standard_uncertainties).max() < 4 / np.sqrt(n)
    assert errors.std(axis=0) / fits[0].standard_uncertainties == pytest.approx(np.ones(9), abs=4 / np.sqrt(2 * n))
    squares = [e @ np.linalg.solve(covariance, e) for e in errors]
    assert np.mean(squares) == pytest.approx(9.0, abs=4 * np.sqrt(18 / n))  # chi-square, 9 degrees of freedom
    assert np.mean([f.chi_square for f in fits]) == pytest.approx(3.0, abs=4 * np.sqrt(6 / n))  # 12 − 9 left


def test_the_gain_is_the_derivative_of_the_estimate():
    fit = fit_scalar("it", MEANS, white(1e-5), G, nominal_start())
    for i, c in ((0, 0), (7, 1), (11, 2)):
        moved = MEANS.copy()
        moved[i, c] += 1e-5
        change = (fit_scalar("it", moved, white(1e-5), G, nominal_start()).parameters - fit.parameters) / 1e-5
        assert fit.gain[:, i, c] == pytest.approx(change, rel=1e-3, abs=1e-5)


def test_unknown_noise_is_scaled_up_to_the_residuals():
    rng = np.random.default_rng(4)
    angles = [TableAngles(0.0, float(m), float(i)) for m in range(-80, 81, 40) for i in range(0, 360, 45)]
    vectors = reference_vectors("accelerometer", angles, SITE)
    noisy = B_ACCELEROMETER + vectors @ K_ACCELEROMETER.T + 1e-3 * rng.normal(size=vectors.shape)
    n = len(angles)
    guessed = fit_scalar("it", noisy, white(1e-4, n), G, nominal_start(), noise_known=False)
    known = fit_scalar("it", noisy, white(1e-3, n), G, nominal_start())
    ratio = guessed.standard_uncertainties / known.standard_uncertainties
    assert ratio == pytest.approx(np.ones(9), abs=4 / np.sqrt(2 * (n - 9)))
    assert guessed.p_value is None
