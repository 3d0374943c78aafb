"""Magnitudes after correction: by hand, and against the prediction over many units."""

import numpy as np
import pytest
from scipy.special import chdtri

from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.calibration.verification import (
    effective_freedom,
    error_covariance,
    magnitudes,
    predicted_sd,
)
from procedures.analysis.least_squares.chi_square import chi_square, tail_probability
from procedures.analysis.orientation_plan.requirements import chance_of_failure, sound_unit_fails
from procedures.core.imu_model import triad_calibration
from procedures.core.limits import Limit, PlannedCheck
from procedures.core.table_angles import TableAngles
from procedures.core.unit import TriadRecord
from tests.kit.forward_model import ACCELEROMETER_NOISE, B_ACCELEROMETER, K_ACCELEROMETER, SITE

ANGLES = [TableAngles(20.0 * i, 10.0 * i, 40.0 * i) for i in range(9)]
VECTORS = reference_vectors("accelerometer", ANGLES, SITE)
TRUTH = np.column_stack([B_ACCELEROMETER, K_ACCELEROMETER]).ravel()
NOISE = np.array([mean_covariance(ACCELEROMETER_NOISE, [[80.0 * i, 80.0 * i + 70] for i in range(9)])] * 3)


def test_statistics_by_hand():
    identity = triad_calibration("accelerometer", "m/s^2", "m/s^2", np.eye(3, 4, 1).ravel(), np.zeros((12, 12)))
    found = magnitudes(np.array([[10.0, 0, 0], [0, 9.0, 0], [0, 0, 11.0]]), identity, 9.5, "abc")
    assert found.after == pytest.approx((10.0, 9.0, 11.0))
    assert found.mean_error_after == pytest.approx(0.5)
    assert found.sd_after == pytest.approx(1.0)
    assert found.per_axis == pytest.approx(1 / np.sqrt(3))  # thesis 5.1
    assert found.before == pytest.approx(found.after)


def test_outputs_in_counts_have_no_magnitude_before():
    scale = np.column_stack([np.zeros(3), np.eye(3) * 100.0]).ravel()
    counts = triad_calibration("accelerometer", "count", "m/s^2", scale, np.zeros((12, 12)))
    found = magnitudes(np.eye(3) * 981.0, counts, 9.81, "abc")
    assert found.before is None
    assert found.after == pytest.approx((9.81,) * 3)


def test_the_predicted_covariance_over_many_units():
    rng, n, bias_sd, scale_sd = np.random.default_rng(21), 1000, 2e-5, 3e-6
    spread = np.tile([1e-5, 1e-6, 2e-6, 2e-6], 3)
    calibration_covariance = np.diag(spread**2)
    record = TriadRecord((ACCELEROMETER_NOISE,) * 3, bias_sd, scale_sd)
    errors, p_values = np.zeros((n, 9)), np.zeros(n)
    for k in range(n):
        launch = [rng.normal(size=3) * bias_sd for _ in range(2)], [rng.normal(size=3) * scale_sd for _ in range(2)]
        measured = np.column_stack(
            [B_ACCELEROMETER + launch[0][0], K_ACCELEROMETER * (1 + launch[1][0])[:, None]]
        ).ravel() + spread * rng.normal(size=12)
        calibration = triad_calibration("accelerometer", "m/s^2", "m/s^2", measured, calibration_covariance)
        means = B_ACCELEROMETER + launch[0][1] + VECTORS @ (K_ACCELEROMETER * (1 + launch[1][1])[:, None]).T
        means += np.array([np.linalg.cholesky(c) @ rng.normal(size=9) for c in NOISE]).T
        covariance = error_covariance(VECTORS, calibration, NOISE, record)
        errors[k] = magnitudes(means, calibration, SITE.gravity_m_s2, ANGLES_LABELS).errors
        p_values[k] = tail_probability(chi_square(errors[k], covariance), 9)
    # Nine standard deviations of n values each: relative error 1/√(2n); four of them, and a little for nine at once.
    assert errors.std(axis=0) / np.sqrt(np.diagonal(covariance)) == pytest.approx(np.ones(9), abs=4.5 / np.sqrt(2 * n))
    assert p_values.mean() == pytest.approx(0.5, abs=4 * 0.289 / np.sqrt(n))
    # The mean sample variance over stations; its own relative error is at most that of one station.
    expected = predicted_sd(covariance)
    assert np.sqrt(np.mean(errors.var(axis=1, ddof=1))) == pytest.approx(expected, rel=4.5 / np.sqrt(2 * n))


ANGLES_LABELS = tuple(str(i) for i in range(9))


def test_the_expanded_uncertainty_of_a_root_mean_square_over_few_changes():
    """Stations that a few coefficients move together: k of Satterthwaite's degrees of freedom, against draws.

    Of 2·10⁵ draws a level of 0.01 is exceeded by 2000 ± 45; the two moments leave the tail within a fifth of that.
    """
    rng, n = np.random.default_rng(5), 200_000
    few = rng.normal(size=(9, 2))
    covariance = few @ few.T + 0.01 * np.eye(9)
    errors = rng.normal(size=(n, 2)) @ few.T + 0.1 * rng.normal(size=(n, 9))
    squares = errors.var(axis=1, ddof=1) / predicted_sd(covariance) ** 2
    assert squares.mean() == pytest.approx(1.0, abs=5.0 * squares.std() / np.sqrt(n))
    freedom = effective_freedom(covariance)
    assert freedom < 3.0
    assert freedom == pytest.approx(2.0 / squares.var(), rel=0.05)  # variance of χ²_ν/ν
    level = 0.01
    assert np.mean(squares > chdtri(freedom, level) / freedom) == pytest.approx(level, rel=0.2)
    assert np.mean(squares > 4.0) > 1.5 * level, "k = 2 would refuse more than that"
    assert effective_freedom(np.eye(9)) == pytest.approx(8.0)


def test_the_chance_that_a_sound_unit_fails_is_that_of_draws():
    """20 000 draws find a chance of 0.1 to ± 0.002; the two moments leave it within a percentage point."""
    rng, n = np.random.default_rng(6), 20_000
    few = rng.normal(size=(9, 2))
    covariance = few @ few.T + 0.01 * np.eye(9)
    drawn = (rng.normal(size=(n, 2)) @ few.T + 0.1 * rng.normal(size=(n, 9))).std(axis=1, ddof=1) / np.sqrt(3.0)
    u, freedom = predicted_sd(covariance) / np.sqrt(3.0), effective_freedom(covariance)
    for quantile in (0.5, 0.9, 0.98):
        limit = Limit("m/s^2", maximum=float(np.quantile(drawn, quantile)))
        planned = PlannedCheck("δ/√3", limit, u, freedom, 0.0)
        chance = sound_unit_fails(planned)
        assert chance is not None
        assert chance == pytest.approx(1.0 - quantile, abs=0.03 if quantile == 0.5 else 0.014)
        warned = chance_of_failure(planned)
        assert warned is not None
        assert f"{100.0 * chance:.2g} %" in warned
    assert chance_of_failure(PlannedCheck("δ/√3", Limit("1", maximum=10.0 * u), u, freedom)) is None
    assert sound_unit_fails(PlannedCheck("δ/√3", Limit("1", maximum=1.0))) is None
