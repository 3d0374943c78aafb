"""Estimates so far: the filter against closed forms, coefficients against generalised least squares and simulation."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.analysis.allan.deviation import deviation
from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.station_means import StationMeans
from procedures.analysis.calibration.table_errors import TableUncertainty, table_errors
from procedures.analysis.so_far.coefficients import BIAS_PRIOR, MATRIX_PRIOR, coefficients_so_far
from procedures.analysis.so_far.dwell import allan_so_far, bias_so_far
from procedures.core.errors import UnfitRecording
from procedures.core.noise import NoiseCoefficients
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles

SITE = Site(latitude_deg=50.0, gravity_m_s2=9.81)
IDEAL = TableUncertainty()
ANGLES = [TableAngles(0.0, middle, inner) for middle in (0.0, 90.0, 180.0, 270.0) for inner in (0.0, 90.0, 180.0)]


def accelerometer(rng: np.random.Generator, sd: float, angles: list[TableAngles]) -> tuple[StationMeans, np.ndarray]:
    """Means of a triad with drawn coefficients and white noise `sd`, and those coefficients, shape (12,)."""
    bias, matrix = rng.normal(0.0, 0.02, 3), np.eye(3) + rng.normal(0.0, 0.01, (3, 3))
    vectors = reference_vectors("accelerometer", angles, SITE)
    n = len(angles)
    outputs = bias + vectors @ matrix.T + rng.normal(0.0, sd, (n, 3))
    begun = np.linspace(0.0, 100.0 * (n - 1), n)
    windows = np.column_stack([begun, begun + 70.0])
    each = np.full((n, 3), sd)
    given = (each, each, np.zeros((n, 3)), windows, (28_000,) * n, ("",) * n, tuple(angles))
    return StationMeans("accelerometer", "m/s^2", outputs, *given), np.column_stack([bias, matrix]).ravel()


def test_under_white_noise_the_filter_is_the_mean_and_its_uncertainty_falls_with_the_root_of_time() -> None:
    rng = np.random.default_rng(1)
    means = 3.0 + rng.normal(0.0, 0.2, 200)
    found = bias_so_far(means, 0.5, NoiseCoefficients(random_walk=0.2 * np.sqrt(0.5)))
    # N² / T is the variance of a window's mean: here 0.2², and of the whole 0.2² / 200
    assert found.estimate == pytest.approx(means.mean(), rel=1e-12)
    assert found.standard_uncertainty == pytest.approx(0.2 / np.sqrt(200), rel=1e-12)
    assert found.course_uncertainty == pytest.approx(0.2 / np.sqrt(found.at_s / 0.5), rel=1e-12)
    # 199 squared innovations of mean 1: their mean has the deviation sqrt(2/199) = 0.1; four of it, and the root halves
    assert found.innovations_rms == pytest.approx(1.0, abs=0.2)


def test_an_unknown_noise_is_taken_from_the_dwell_and_a_false_one_shows_in_the_innovations() -> None:
    means = np.random.default_rng(2).normal(0.0, 1.0, 4000)
    found = bias_so_far(means, 1.0, None)
    assert not found.noise_known
    # 200 windows: their variance is known to 2·sqrt(2/199) = 20 % at two sigma, their correlation to 0.07 each way
    assert found.standard_uncertainty == pytest.approx(1.0 / np.sqrt(4000), rel=0.3)
    assert bias_so_far(means, 1.0, NoiseCoefficients(random_walk=0.1)).innovations_rms > 5.0


def test_the_allan_deviation_of_cells_is_that_of_the_samples() -> None:
    samples = np.random.default_rng(3).normal(0.0, 1.0, 64_000)
    found = allan_so_far(samples.reshape(-1, 10).mean(axis=1), 0.1)
    of_samples = deviation(samples, 100.0, sizes=[10, 160])
    # 1/sqrt(tau·rate) by theory; of the samples the terms overlap more: the two differ by their own scatter
    assert found.deviation[0] == pytest.approx(of_samples.deviation[0], rel=0.03)
    white = 0.1 / np.sqrt(found.tau_s)
    inside = (found.lower < white) & (white < found.upper)
    assert np.mean(inside) > 0.3  # one-sigma intervals of correlated points
    assert found.deviation[:4] == pytest.approx(white[:4], rel=0.1)


def test_too_short_and_constant_dwells_are_refused() -> None:
    with pytest.raises(UnfitRecording, match="needs 20"):
        bias_so_far(np.zeros(5), 1.0, None)
    with pytest.raises(UnfitRecording, match="constant"):
        bias_so_far(np.zeros(100), 1.0, None)
    with pytest.raises(UnfitRecording, match="needs 16"):
        allan_so_far(np.zeros(5), 1.0)


def test_after_the_last_station_the_prior_no_longer_counts_and_after_the_first_little_else_does() -> None:
    means, truth = accelerometer(np.random.default_rng(4), 1e-4, ANGLES)
    found = coefficients_so_far(means, SITE, None, IDEAL)
    design = np.column_stack([np.ones(len(ANGLES)), reference_vectors("accelerometer", ANGLES, SITE)])
    plain = np.linalg.lstsq(design, means.outputs, rcond=None)[0].T.ravel()
    sd = np.tile(1e-4 * np.sqrt(np.diagonal(np.linalg.inv(design.T @ design))), 3)
    # the prior pulls by (sd/prior)²: 1e-7 of a standard uncertainty
    assert np.abs(found.values[-1] - plain).max() < 1e-3 * sd.min()
    assert found.standard_uncertainties[-1] == pytest.approx(sd, rel=1e-3)
    assert all(found.determined[-1])
    assert not any(found.determined[0])
    first = found.standard_uncertainties[0].reshape(3, 4)
    assert first[:, [1, 3]] == pytest.approx(np.full((3, 2), MATRIX_PRIOR))  # y is up: nothing along x and z
    # b + K·g is known, so of b and K·g the smaller prior is nearly all that is left: 1 of hypot(1, 0.5·9.81)
    left = (
        BIAS_PRIOR["accelerometer"] * MATRIX_PRIOR * 9.81 / np.hypot(BIAS_PRIOR["accelerometer"], MATRIX_PRIOR * 9.81)
    )
    assert first[:, 0] == pytest.approx(np.full(3, left), rel=1e-3)
    assert np.all(np.diff(found.standard_uncertainties, axis=0) <= 1e-15)
    assert np.abs((found.values[-1] - truth) / sd).max() < 5.0


def test_the_uncertainties_hold_at_every_station() -> None:
    rng = np.random.default_rng(5)
    scores = []
    for _ in range(100):
        means, truth = accelerometer(rng, 1e-3, ANGLES[:6])
        found = coefficients_so_far(means, SITE, None, IDEAL)
        determined = np.array(found.determined)
        scores.append(np.where(determined, (found.values - truth) / found.standard_uncertainties, np.nan)[-1])
    known = np.array(scores)[:, ~np.isnan(scores[0])]
    assert known.shape[1] >= 6
    # variance of a unit normal from 100 draws: 1 ± sqrt(2/100) = 0.14; of the largest of twelve at four sigma 0.57
    assert np.var(known, axis=0) == pytest.approx(np.ones(known.shape[1]), abs=0.57)


def test_counts_and_stations_without_angles_have_no_coefficients_so_far() -> None:
    means, _ = accelerometer(np.random.default_rng(6), 1e-3, ANGLES)
    with pytest.raises(UnfitRecording, match="in count"):
        coefficients_so_far(replace(means, output_unit="count"), SITE, None, IDEAL)
    with pytest.raises(UnfitRecording, match="no table angles"):
        coefficients_so_far(replace(means, angles=(None, *means.angles[1:])), SITE, None, IDEAL)


def test_with_a_coarse_table_the_uncertainties_still_hold() -> None:
    rng = np.random.default_rng(7)
    table = TableUncertainty(orthogonality_sd_arcsec=20.0, pointing_sd_arcsec=10.0)
    scores = []
    for _ in range(100):
        means, truth = accelerometer(rng, 1e-5, ANGLES)
        vectors = reference_vectors("accelerometer", ANGLES, SITE)
        flaws = table_errors(ANGLES, vectors, table, of_gravity=True)
        matrix = truth.reshape(3, 4)[:, 1:]
        means.outputs[:] += np.einsum("ncp,p->nc", flaws.of_outputs(matrix), rng.normal(size=len(flaws.sd)))
        found = coefficients_so_far(means, SITE, None, table)
        scores.append((found.values[-1] - truth) / found.standard_uncertainties[-1])
    # as above
    assert np.var(np.array(scores), axis=0) == pytest.approx(np.ones(12), abs=0.57)
