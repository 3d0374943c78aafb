"""Generalised least squares over orientations: exact, honest about its uncertainty, as sharp as theory allows."""

from functools import cache

import numpy as np
import pytest
from scipy.linalg import block_diag

from procedures.analysis.calibration.estimator import Weighting, estimator, table_share
from procedures.analysis.calibration.multiposition import TriadFit, fit_triad
from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.calibration.table_errors import TableErrors, TableUncertainty, table_errors
from procedures.core.errors import Undetermined
from procedures.core.frames import orientation_beta_gamma
from procedures.core.recording import Station
from tests.kit.forward_model import (
    ACCELEROMETER_NOISE,
    B_ACCELEROMETER,
    B_GYRO,
    BETA_GAMMA,
    GYRO_NOISE,
    K_ACCELEROMETER,
    K_GYRO,
    SITE,
    Table,
    random_table,
)
from tests.validation.bounds import bayesian_bound, cramer_rao_bound

N = 250
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


def fit(
    triad: str,
    means: np.ndarray,
    uncertainty: TableUncertainty,
    known: bool = True,
    weighting: Weighting = "noise_and_table",
    noise: np.ndarray | None = None,
) -> TriadFit:
    vectors, table = reference(triad, uncertainty)
    c = NOISE[triad] if noise is None else noise
    return fit_triad(triad, UNITS[triad], UNITS[triad], vectors, means, c, table, known, weighting)


@cache
def many(triad: str, uncertainty: TableUncertainty, weighting: Weighting) -> tuple[list[TriadFit], np.ndarray]:
    """N units on N tables: their fits, and the station means (N, 12, 3) that these were made from."""
    rng, u = np.random.default_rng(11), uncertainty
    sds = (u.orthogonality_sd_arcsec, u.pointing_sd_arcsec, u.level_sd_arcsec, u.azimuth_sd_arcsec)
    means = np.array([outputs(triad, random_table(rng, *sds), rng) for _ in range(N)])
    return [fit(triad, m, uncertainty, weighting=weighting) for m in means], means


WEIGHTED: Weighting = "noise_and_table"
BOTH = pytest.mark.parametrize("weighting", [WEIGHTED, "noise"])


@pytest.mark.parametrize("triad", ["gyro", "accelerometer"])
def test_without_noise_the_truth_comes_back(triad: str):
    found = fit(triad, outputs(triad, Table(), None), TableUncertainty())
    assert found.coefficients == pytest.approx(TRUTH[triad], rel=1e-9, abs=1e-12)
    assert found.chi_square < 1e-3
    assert found.calibration().coefficients == pytest.approx(found.coefficients)


@BOTH
@pytest.mark.parametrize("triad", ["gyro", "accelerometer"])
@pytest.mark.parametrize("uncertainty", [TableUncertainty(), FLAWED], ids=["ideal table", "3″ and 5″ table"])
def test_errors_over_many_units_have_the_spread_that_is_claimed(
    triad: str, uncertainty: TableUncertainty, weighting: Weighting
):
    n, fits = N, many(triad, uncertainty, weighting)[0]
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


@BOTH
@pytest.mark.parametrize("triad", ["gyro", "accelerometer"])
@pytest.mark.parametrize("uncertainty", [TableUncertainty(), FLAWED], ids=["ideal table", "3″ and 5″ table"])
def test_chi_square_and_residuals_are_as_expected(triad: str, uncertainty: TableUncertainty, weighting: Weighting):
    n, fits = N, many(triad, uncertainty, weighting)[0]
    p = np.array([f.p_value for f in fits], dtype=float)
    # Uniform p: mean ½ ± 4·0.289/√n; 24 degrees of freedom: mean ± 4·√(48/n).
    assert p.mean() == pytest.approx(0.5, abs=4 * 0.289 / np.sqrt(n))
    assert np.mean([f.chi_square for f in fits]) == pytest.approx(24.0, abs=4 * np.sqrt(48 / n))
    assert fits[0].degrees_of_freedom == 24
    ratio = np.array([f.residuals for f in fits]).std(axis=0) / fits[0].residual_sd
    assert ratio == pytest.approx(np.ones((12, 3)), abs=4.5 / np.sqrt(2 * n))  # 36 of them at once


@BOTH
def test_magnitudes_after_correction_have_the_spread_that_is_claimed(weighting: Weighting):
    fits, means = many("accelerometer", FLAWED, weighting)
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


def test_with_table_errors_the_joint_bound_of_both_triads_is_reached():
    fits = [fit(t, outputs(t, Table(), None), FLAWED) for t in ("gyro", "accelerometer")]
    vectors = tuple(reference_vectors(f.triad, ANGLES, SITE) for f in fits)
    tables = tuple(table_errors(ANGLES, v, FLAWED, of_gravity=v is vectors[1]) for v in vectors)
    noise, matrices = tuple(NOISE.values()), tuple(f.matrix for f in fits)
    bound = np.sqrt(np.diagonal(bayesian_bound(vectors, noise, tables, matrices)))  # pyright: ignore
    claimed = np.sqrt(np.concatenate([np.diagonal(f.covariance) for f in fits]))
    assert np.all(bound <= claimed * (1 + 1e-9))
    assert np.all(claimed[:12] < 1.01 * bound[:12])  # what gyros could still learn of pointing from accelerometers
    assert np.all(claimed[12:] < 1.001 * bound[12:])
    gyro, accelerometer = (f.table.per_sd for f in fits)
    assert np.abs(gyro @ accelerometer.T).max() > 0.0  # the same tilt in both triads


def test_the_thesis_s_least_squares_is_never_better_and_much_worse_for_accelerometers():
    for triad, at_least in (("gyro", 1.0), ("accelerometer", 10.0)):
        means = outputs(triad, Table(), None)
        sds = [np.sqrt(np.diagonal(fit(triad, means, FLAWED, weighting=w).covariance)) for w in ("noise", WEIGHTED)]
        assert np.all(sds[0] >= sds[1] * (1 - 1e-9))
        assert np.max(sds[0] / sds[1]) > at_least


def stacked_design(triad: str) -> np.ndarray:
    vectors = reference_vectors(triad, ANGLES, SITE)
    return block_diag(*[np.column_stack([np.ones(12), vectors])] * 3)


@BOTH
@pytest.mark.parametrize("triad", ["gyro", "accelerometer"])
def test_noise_and_table_add_up_to_what_the_estimator_makes_of_them(triad: str, weighting: Weighting):
    found = fit(triad, outputs(triad, Table(), None), FLAWED, weighting=weighting)
    gain = found.estimator.gain.reshape(12, 36)
    flaws = found.of_table.transpose(1, 0, 2).reshape(36, -1)
    noise, both = block_diag(*NOISE[triad]), block_diag(*NOISE[triad]) + flaws @ flaws.T
    size = np.sqrt(np.diagonal(found.covariance))
    for got, expected in ((found.noise_covariance, noise), (found.covariance, both)):
        assert got / np.outer(size, size) == pytest.approx(gain @ expected @ gain.T / np.outer(size, size), abs=1e-9)
    assert gain @ stacked_design(triad) * np.outer(1 / size, size) == pytest.approx(np.eye(12), abs=1e-7)  # unbiased
    if weighting == WEIGHTED:
        rows = np.sqrt(np.diagonal(both))
        a = stacked_design(triad) * size / rows[:, None]
        inverse = np.linalg.inv(a.T @ np.linalg.solve(both / np.outer(rows, rows), a))  # (AᵀS⁻¹A)⁻¹
        assert found.covariance / np.outer(size, size) == pytest.approx(inverse, abs=1e-8)


@pytest.mark.parametrize("triad", ["gyro", "accelerometer"])
def test_on_an_ideal_table_both_weightings_are_one(triad: str):
    means = outputs(triad, Table(), np.random.default_rng(8))
    thesis, ours = (fit(triad, means, TableUncertainty(), weighting=w) for w in ("noise", WEIGHTED))
    assert ours.coefficients == pytest.approx(thesis.coefficients, rel=1e-12, abs=0.0)
    assert ours.covariance == pytest.approx(thesis.covariance, rel=1e-12, abs=0.0)
    # And towards one: the other way to solve it, with flaws far beneath the noise.
    sd = np.sqrt(np.diagonal(thesis.covariance))
    nearly = fit(triad, means, TableUncertainty(1e-7, 1e-7, 1e-7, 1e-7, 1e-13))
    assert nearly.coefficients / sd == pytest.approx(thesis.coefficients / sd, abs=1e-6)
    assert np.sqrt(np.diagonal(nearly.covariance)) == pytest.approx(sd, rel=1e-9)


@pytest.mark.parametrize("triad", ["gyro", "accelerometer"])
def test_another_pass_would_change_nothing(triad: str):
    vectors, table = reference(triad, FLAWED)
    fits, means = many(triad, FLAWED, WEIGHTED)
    for found, m in list(zip(fits, means, strict=True))[:20]:
        again = estimator("it", vectors, NOISE[triad], table.of_outputs(found.matrix)).coefficients(m)
        change = (again - found.coefficients) / np.sqrt(np.diagonal(found.covariance))
        assert np.abs(change).max() < 0.01


def test_dwells_so_long_that_noise_vanishes_beside_the_table_are_no_trouble():
    vectors, table = reference("accelerometer", FLAWED)
    flaws = table.of_outputs(np.eye(3))
    noise, total = [], []
    for sd in (1e-10, 1e-11, 1e-14):  # [m/s²], where the flaws are 2e-4: S = C + F·Fᵀ has no C left at the last
        plan = estimator("it", vectors, np.array([np.eye(12) * sd**2] * 3), flaws)
        noise.append(np.sqrt(np.diagonal(plan.noise_covariance)))
        total.append(
            np.sqrt(np.diagonal(plan.noise_covariance + table_share(plan, flaws, table, np.eye(3)).covariance))
        )
    assert noise[1] == pytest.approx(0.1 * noise[0], rel=1e-3, abs=0.0)
    pointed = total[0] > 1e-7
    assert pointed.sum() == 6  # what magnitudes do not tell
    assert total[2][pointed] == pytest.approx(total[0][pointed], rel=1e-6)
    assert np.all(total[2][~pointed] < total[1][~pointed])


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


@BOTH
def test_unknown_noise_is_found_beside_flaws_that_are_far_larger(weighting: Weighting):
    rng, factors, errors = np.random.default_rng(12), [], []
    for _ in range(60):
        means = outputs("accelerometer", random_table(rng, 3.0, 5.0, 3.0, 10.0), rng)
        found = fit("accelerometer", means, FLAWED, False, weighting, NOISE["accelerometer"] / 100.0)
        factors.append(found.station_noise[0, 0, 0] / NOISE["accelerometer"][0, 0, 0])
        errors.append((found.coefficients - TRUTH["accelerometer"]) / np.sqrt(np.diagonal(found.covariance)))
    # Twelve magnitudes less nine parameters leave three residuals that no flaw can explain: the median of χ²/3 is
    # 0.79, that of sixty is known to 1.25·√(2/3)/√60 = 13 %, and a few more residuals are explained in part.
    assert 0.5 < np.median(factors) < 1.3
    # Student's t of three degrees at the worst: 95 % of it lies within 3.2, of a normal one 98 % within 2.4.
    assert np.mean(np.abs(errors) < 3.2) > 0.95


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
