"""Least squares, on which every fit stands, against closed forms and scipy's own."""

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal

from procedures.analysis.calibration.magnitude import magnitude_covariance, magnitude_gradient
from procedures.analysis.least_squares.chi_square import chi_square, judged_p_value, residual_factor, tail_probability
from procedures.analysis.least_squares.inverse import scaled_pinv
from procedures.core.noise import NoiseCoefficients
from procedures.core.unit import TriadRecord


def test_the_pseudo_inverse_does_not_depend_on_units() -> None:
    design = np.random.default_rng(1).standard_normal((30, 4))
    sizes = np.array([1e-12, 1.0, 1e6, 1e14])
    plain = np.linalg.pinv(design)
    # numpy's own cut of 1e-15 of the largest singular value would lose the smallest columns here.
    np.testing.assert_allclose(scaled_pinv(design * sizes), plain / sizes[:, None], rtol=1e-11)
    silent = design.copy()
    silent[:, 2] = 0.0
    inverse = scaled_pinv(silent)
    assert np.all(inverse[2] == 0.0)
    np.testing.assert_allclose(inverse[[0, 1, 3]], np.linalg.pinv(design[:, [0, 1, 3]]), rtol=1e-11, atol=1e-15)


def test_chi_square_is_that_of_the_gaussian_density() -> None:
    rng = np.random.default_rng(2)
    root = rng.standard_normal((5, 5))
    covariance, errors = root @ root.T + np.eye(5), rng.standard_normal(5)
    density = multivariate_normal(np.zeros(5), covariance)
    assert chi_square(errors, covariance) == pytest.approx(2.0 * (density.logpdf(np.zeros(5)) - density.logpdf(errors)))
    assert chi_square(np.zeros(0), np.zeros((0, 0))) == 0.0
    assert tail_probability(7.0, 3) == pytest.approx(chi2.sf(7.0, 3), rel=1e-12)
    assert judged_p_value(7.0, 3, noise_known=True) == tail_probability(7.0, 3)
    assert judged_p_value(7.0, 3, noise_known=False) is None
    assert judged_p_value(0.0, 0, noise_known=True) is None
    assert [residual_factor(12.0, 4, known) for known in (True, False)] == [1.0, 3.0]
    assert (residual_factor(2.0, 4, noise_known=False), residual_factor(0.0, 0, noise_known=False)) == (1.0, 1.0)


def test_the_gradient_of_a_magnitude_and_its_covariance() -> None:
    rng = np.random.default_rng(3)
    matrix = np.eye(3) + 0.1 * rng.standard_normal((3, 3))
    correction, vectors = np.linalg.inv(matrix), rng.standard_normal((4, 3))
    gradient = magnitude_gradient(vectors, correction)
    step = 1e-6
    for c in range(3):
        ends = [np.linalg.norm((vectors @ matrix.T + s * step * np.eye(3)[c]) @ correction.T, axis=1) for s in (1, -1)]
        # Central differences: the third derivative leaves step²/|v|² of it, rounding 1e-16/step.
        np.testing.assert_allclose(gradient[:, c], (ends[0] - ends[1]) / (2 * step), atol=1e-8)
    covariances = np.array([np.diag(rng.uniform(1.0, 2.0, 4)) + 0.5 for _ in range(3)])
    wanted = sum(np.diag(w) @ c @ np.diag(w) for w, c in zip(gradient.T, covariances, strict=True))
    np.testing.assert_allclose(magnitude_covariance(gradient, covariances), wanted, rtol=1e-12)


def test_launches_scatter_as_the_record_says() -> None:
    """Variances of 4000 drawn launches: relative standard deviation √(2/4000) = 2.2 %, five of them of 18 entries."""
    record = TriadRecord((NoiseCoefficients(),) * 3, 2.0, 0.5)
    outputs = np.array([[1.0, 2.0, 3.0], [4.0, -5.0, 6.0]])
    rng, n = np.random.default_rng(4), 4000
    bias, scale = 2.0 * rng.standard_normal((n, 1, 3)), 0.5 * rng.standard_normal((n, 1, 3))
    drawn = bias + scale * outputs
    found = np.einsum("kic,kjc->cij", drawn, drawn) / n
    wanted = record.launch_covariance(outputs)
    spread = np.sqrt((wanted**2 + np.einsum("cii,cjj->cij", wanted, wanted)) / n)  # of a sample covariance
    assert np.all(np.abs(found - wanted) < 5.0 * spread)
