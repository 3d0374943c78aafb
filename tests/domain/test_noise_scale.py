"""The factor on noise that nobody knows: by hand, beside flaws of a table, and with a table worse than declared."""

import numpy as np
import pytest

from procedures.analysis.calibration.noise_scale import noise_factor


def test_on_an_ideal_table_it_is_chi_square_over_its_degrees():
    y, noise = np.array([3.0, -4.0, 5.0, 6.0]), np.diag([1.0, 4.0, 1.0, 9.0])
    assert noise_factor(y, noise, np.zeros((4, 4))) == pytest.approx((9.0 + 4.0 + 25.0 + 4.0) / 4.0, rel=1e-6)


def test_noise_is_scaled_up_and_never_down():
    assert noise_factor(np.array([0.1, -0.2]), np.eye(2), np.zeros((2, 2))) == 1.0
    assert noise_factor(np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0))) == 1.0


def test_residuals_that_flaws_explain_do_not_count():
    rng, k = np.random.default_rng(3), 400
    flaws = np.diag(np.where(np.arange(k) < k // 2, 1e6, 0.0))
    y = rng.normal(size=k) * np.sqrt(25.0 + np.diagonal(flaws))
    assert noise_factor(y, np.eye(k), flaws) == pytest.approx(25.0, rel=4 * np.sqrt(2 / (k / 2)))


def test_a_table_far_worse_than_declared_raises_it_too():
    rng, k = np.random.default_rng(4), 24
    flaws = np.diag(np.where(np.arange(k) < k - 3, 600.0, 0.0))
    y = rng.normal(size=k) * np.sqrt(1.0 + 25.0 * np.diagonal(flaws))
    assert noise_factor(y, np.eye(k), flaws) > 1000.0
