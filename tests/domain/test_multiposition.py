"""Generalised least squares over orientations: exact, honest about its uncertainty, as sharp as theory allows."""

from functools import cache

import numpy as np
import pytest
from scipy.linalg import block_diag

from procedures.analysis.bounds import bayesian_bound, cramer_rao_bound
from procedures.analysis.multiposition import TriadFit, fit_triad, joint_table_covariance
from procedures.analysis.reference import reference_vectors
from procedures.analysis.station_noise import mean_covariance
from procedures.analysis.table_errors import TableErrors, TableUncertainty, table_errors
from procedures.core.errors import Undetermined
from procedures.core.frames import orientation_beta_gamma
from procedures.core.recording import Station
from tests.domain.forward_model import (
    ACCELEROMETER_NOISE,
    B_ACCELEROMETER,
    B_GYRO,
    GYRO_NOISE,
    K_ACCELEROMETER,
    K_GYRO,
    SITE,
    Table,
    random_table,
)

N = 250
BETA_GAMMA = [(0, -90), (0, 90), (90, 0), (-90, 0), (0, 0), (180, 0)]
BETA_GAMMA += [(-90, -45), (90, 45), (180, -45), (0, 45), (135, 0), (-45, 0)]
STATIONS = [Station(i, "", orientation_beta_gamma(b, g)) for i, (b, g) in enumerate(BETA_GAMMA)]
ANGLES = [orientation_beta_gamma(b, g) for b, g in BETA_GAMMA]
WINDOWS = np.array([[10.0 + 80.0 * i, 80.0 + 80.0 * i] for i in range(12)])
TRUTH = {
    "gyro": np.column_stack([B_GYRO, K_GYRO]).ravel(),
    "accelerometer": np.column_stack([B_ACCELEROMETER, K_ACCELEROMETER]).ravel(),
}
NOISE = {
    "gyro": np.array([mean_covariance(GYRO_NOISE, WINDOWS)] * 3),
    "accelerometer": np.array([mean_covariance(ACCELEROMETER_NOISE, WINDOWS)] * 3),
}
UNITS = {"gyro": "rad/s", "accelerometer": "m/s^2"}
FLAWED = TableUncertainty(
    orthogonality_sd_arcsec=3.0, pointing_sd_arcsec=5.0, level_sd_arcsec=3.0, azimuth_sd_arcsec=10.0
)


def outputs(triad: str, table: Table, rng: np.random.Generator | None) -> np.ndarray:
    """Station means of a unit on a table, with noise where there are dice."""
    bias, matrix = TRUTH[triad].reshape(3, 4)[:, 0], TRUTH[triad].reshape(3, 4)[:, 1:]
    which = 0 if triad == "gyro" else 1
    means = np.array([bias + matrix @ table.vectors(s, SITE)[which] for s in STATIONS])
    if rng is not None:
        for c in range(3):
            means[:, c] += np.linalg.cholesky(NOISE[triad][c]) @ rng.normal(size=len(STATIONS))
    return means


@cache
def reference(triad: str, uncertainty: TableUncertainty) -> tuple[np.ndarray, TableErrors]:
    vectors = reference_vectors(triad, ANGLES, SITE)
    return vectors, table_errors(ANGLES, vectors, uncertainty, of_gravity=triad == "accelerometer")


def fit(triad: str, means: np.ndarray, uncertainty: TableUncertainty, known: bool = True) -> TriadFit:
    vectors, table = reference(triad, uncertainty)
    return fit_triad(triad, UNITS[triad], UNITS[triad], vectors, means, NOISE[triad], table, known)


@cache
def many(triad: str, uncertainty: TableUncertainty) -> tuple[list[TriadFit], np.ndarray]:
    """N units on N tables: their fits, and the station means (N, 12, 3) that these were made from."""
    rng, u = np.random.default_rng(11), uncertainty
    sds = (u.orthogonality_sd_arcsec, u.pointing_sd_arcsec, u.level_sd_arcsec, u.azimuth_sd_arcsec)
    means = np.array([outputs(triad, random_table(rng, *sds), rng) for _ in range(N)])
    return [fit(triad, m, uncertainty) for m in means], means


@pytest.mark.parametrize("triad", ["gyro", "accelerometer"])
def test_without_noise_the_truth_comes_back(triad: str):
    found = fit(triad, outputs(triad, Table(), None), TableUncertainty())
    assert found.coefficients == pytest.approx(TRUTH[triad], rel=1e-9, abs=1e-12)
    assert found.chi_square < 1e-3
    assert found.calibration().coefficients == pytest.approx(found.coefficients)


@pytest.mark.parametrize("triad", ["gyro", "accelerometer"])
@pytest.mark.parametrize("uncertainty", [TableUncertainty(), FLAWED], ids=["ideal table", "3″ and 5″ table"])
def test_errors_over_many_units_have_the_spread_that_is_claimed(triad: str, uncertainty: TableUncertainty):
    n, fits = N, many(triad, uncertainty)[0]
    errors = np.array([f.coefficients for f in fits]) - TRUTH[triad]
    claimed = np.array([np.sqrt(np.diagonal(f.covariance)) for f in fits])
    normalised = errors / claimed
    # Unbiased: a mean of n has standard deviation 1/√n; four of them, for twelve coefficients.
    assert np.abs(normalised.mean(axis=0)).max() < 4.0 / np.sqrt(n)
    # Spread: a standard deviation of n has relative error 1/√(2n) = 4 %; four of them.
    assert normalised.std(axis=0) == pytest.approx(np.ones(12), abs=4.0 / np.sqrt(2 * n))
    # 95 % intervals: binomial per coefficient, √(0.95·0.05/n) = 1.3 %; the pool is at least as sharp; four of them.
    assert np.mean(np.abs(normalised) < 1.96) == pytest.approx(0.95, abs=0.05)
    # The whole covariance: e'Σ⁻¹e has mean 12 and standard deviation √(24/n) over n; four of them.
    squares = [e @ np.linalg.solve(f.covariance, e) for e, f in zip(errors, fits, strict=True)]
    assert np.mean(squares) == pytest.approx(12.0, abs=4.0 * np.sqrt(24.0 / n))


@pytest.mark.parametrize("triad", ["gyro", "accelerometer"])
@pytest.mark.parametrize("uncertainty", [TableUncertainty(), FLAWED], ids=["ideal table", "3″ and 5″ table"])
def test_chi_square_and_residuals_are_as_expected(triad: str, uncertainty: TableUncertainty):
    n, fits = N, many(triad, uncertainty)[0]
    p = np.array([f.p_value for f in fits], dtype=float)
    # Uniform p: mean ½ ± 4·0.289/√n; 24 degrees of freedom: mean ± 4·√(48/n).
    assert p.mean() == pytest.approx(0.5, abs=4 * 0.289 / np.sqrt(n))
    assert np.mean([f.chi_square for f in fits]) == pytest.approx(24.0, abs=4 * np.sqrt(48 / n))
    assert fits[0].degrees_of_freedom == 24
    ratio = np.array([f.residuals for f in fits]).std(axis=0) / fits[0].residual_sd
    assert ratio == pytest.approx(np.ones((12, 3)), abs=4.5 / np.sqrt(2 * n))  # 36 of them at once


def test_magnitudes_after_correction_have_the_spread_that_is_claimed():
    fits, means = many("accelerometer", FLAWED)
    bias = [f.coefficients.reshape(3, 4)[:, 0] for f in fits]
    corrected = [np.linalg.solve(f.matrix, (m - b).T).T for f, m, b in zip(fits, means, bias, strict=True)]
    errors = np.linalg.norm(corrected, axis=2) - SITE.gravity_m_s2
    assert np.std(errors, axis=0) / fits[0].magnitude_sd == pytest.approx(np.ones(12), abs=4.5 / np.sqrt(2 * N))


def test_no_estimator_can_do_better_without_table_errors():
    for triad, noise in NOISE.items():
        vectors = reference_vectors(triad, ANGLES, SITE)
        design = np.column_stack([np.ones(12), vectors])
        information = block_diag(*[design.T @ np.linalg.solve(c * 1e12, design) for c in noise])
        found = fit(triad, outputs(triad, Table(), None), TableUncertainty()).noise_covariance
        assert cramer_rao_bound(vectors, noise) == pytest.approx(found)
        assert np.linalg.inv(information) * 1e-12 == pytest.approx(found, rel=1e-5, abs=1e-20)


def test_the_bound_with_table_errors_is_beneath_the_claim_and_not_far():
    fits = [fit(t, outputs(t, Table(), None), FLAWED) for t in ("gyro", "accelerometer")]
    vectors = tuple(reference_vectors(f.triad, ANGLES, SITE) for f in fits)
    tables = tuple(table_errors(ANGLES, v, FLAWED, of_gravity=v is vectors[1]) for v in vectors)
    noise, matrices = tuple(NOISE.values()), tuple(f.matrix for f in fits)
    bound = np.sqrt(np.diagonal(bayesian_bound(vectors, noise, tables, matrices)))  # pyright: ignore
    claimed = np.sqrt(np.concatenate([np.diagonal(f.covariance) for f in fits]))
    assert np.all(bound <= claimed * (1 + 1e-9))
    assert np.all(claimed[:12] < 1.01 * bound[:12])  # gyros: their noise is all that counts
    joint = joint_table_covariance(fits[0].table, fits[1].table)
    assert np.allclose(joint[:12, :12], fits[0].table.covariance)
    assert np.abs(joint[:12, 12:]).max() > 0.0  # the same tilt in both triads


def test_the_table_share_is_split_by_source():
    table = fit("accelerometer", outputs("accelerometer", Table(), None), FLAWED).table
    parts = table.by_source()
    assert set(parts) == {"orthogonality", "level", "pointing"}  # gravity does not see the azimuth
    assert np.sum([p**2 for p in parts.values()], axis=0) == pytest.approx(np.diagonal(table.covariance))


def test_noise_that_is_not_known_is_scaled_up_to_the_residuals():
    rng = np.random.default_rng(5)
    means = outputs("gyro", Table(), None) + rng.normal(size=(12, 3)) * 10 * np.sqrt(NOISE["gyro"][0, 0, 0])
    guessed, taken = fit("gyro", means, TableUncertainty(), known=False), fit("gyro", means, TableUncertainty())
    ratio = guessed.noise_covariance[0, 0] / taken.noise_covariance[0, 0]
    assert ratio == pytest.approx(100.0, rel=4 * np.sqrt(2 / 24))  # chi-square with 24 degrees of freedom
    assert guessed.p_value is None


def test_too_few_orientations_name_what_is_lost():
    vectors = reference_vectors("accelerometer", ANGLES[:2], SITE)  # +x and −x up
    table = table_errors(ANGLES[:2], vectors, TableUncertainty(), of_gravity=True)
    with pytest.raises(Undetermined) as refusal:
        fit_triad("accelerometer", "m/s^2", "m/s^2", vectors, vectors, NOISE["gyro"][:, :2, :2], table)
    assert refusal.value.lost == ("K_i2", "K_i3")
    assert refusal.value.rank == 2


def test_four_orientations_are_enough_and_leave_nothing_to_judge():
    pick = [0, 1, 2, 4]
    vectors = reference_vectors("accelerometer", [ANGLES[i] for i in pick], SITE)
    table = table_errors([ANGLES[i] for i in pick], vectors, TableUncertainty(), of_gravity=True)
    noise = NOISE["accelerometer"][np.ix_(range(3), pick, pick)]
    means = outputs("accelerometer", Table(), None)[pick]
    found = fit_triad("accelerometer", "m/s^2", "m/s^2", vectors, means, noise, table)
    assert found.coefficients == pytest.approx(TRUTH["accelerometer"], rel=1e-9, abs=1e-12)
    assert found.degrees_of_freedom == 0
    assert found.p_value is None
