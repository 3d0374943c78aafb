"""Uncertainty budgets: rows whose root sum of squares is what is stated, each by a Monte Carlo of its source alone."""

from typing import Any

import numpy as np
import pytest

from procedures.analysis.calibration.budget import OBSERVED, Budget, budgets, noise_parts, observed_part
from procedures.analysis.calibration.multiposition import TriadFit, fit_triad
from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.station_noise import mean_covariance, triad_covariance
from procedures.analysis.calibration.station_plan import THESIS_ORIENTATIONS
from procedures.analysis.calibration.table_errors import TableErrors, TableUncertainty, table_errors
from procedures.catalog import discover
from procedures.core.errors import BadParameter
from procedures.core.frames import orientation_beta_gamma
from procedures.core.noise import NoiseCoefficients
from procedures.core.unit import TriadRecord
from procedures.core.units import ARCSEC
from tests.kit.forward_model import K_ACCELEROMETER, SITE
from tests.kit.procedures import run, simulated_context

ANGLES = [orientation_beta_gamma(*o) for o in THESIS_ORIENTATIONS]
WINDOWS = np.array([[80.0 * i, 80.0 * i + 70.0] for i in range(len(ANGLES))])
NOISE = NoiseCoefficients(3e-4, 1e-5, 8e-6, 2e-8, 1e-11)
RECORD = TriadRecord((NOISE,) * 3, not_observed=(("rate_random_walk",),) * 3)
DECLARED = TableUncertainty(3.0, 1.5, 1.0, 5.0, 2e-6, 4.0)
VECTORS = reference_vectors("accelerometer", ANGLES, SITE)
TRUTH = np.column_stack([np.array([0.01, -0.02, 0.03]), K_ACCELEROMETER])


def fitted(outputs: np.ndarray) -> tuple[TriadFit, TableErrors]:
    table = table_errors(ANGLES, VECTORS, DECLARED, of_gravity=True)
    noise = triad_covariance(RECORD, WINDOWS)
    assert noise is not None
    return fit_triad("accelerometer", "m/s^2", "m/s^2", VECTORS, outputs, noise, table), table


@pytest.fixture(scope="module")
def fit() -> tuple[TriadFit, TableErrors]:
    return fitted(VECTORS @ TRUTH[:, 1:].T + TRUTH[:, 0])


@pytest.fixture(scope="module")
def made(fit: tuple[TriadFit, TableErrors]) -> tuple[Budget, ...]:
    return budgets(fit[0], noise_parts(RECORD, WINDOWS, "m/s^2"), fit[1])


def contribution(made: tuple[Budget, ...], source: str) -> np.ndarray:
    return np.array([sum(r.contribution for r in b.rows if r.source == source) for b in made])


def test_the_rows_make_up_what_is_stated(fit: tuple[TriadFit, TableErrors], made: tuple[Budget, ...]) -> None:
    stated = fit[0].calibration().standard_uncertainties
    for budget, sd in zip(made, stated, strict=True):
        assert np.sqrt(sum(r.contribution**2 for r in budget.rows)) == pytest.approx(sd, rel=1e-9)
        assert budget.standard_uncertainty == pytest.approx(sd, rel=1e-9)
        assert budget.expanded_uncertainty == pytest.approx(2.0 * sd, rel=1e-4)  # infinite degrees of freedom
        assert (budget.degrees_of_freedom, budget.coverage_probability) == (None, 0.9545)
        for row in budget.rows:
            assert row.value > 0.0
            assert row.contribution == pytest.approx(abs(row.sensitivity) * row.value / row.divisor, rel=1e-12)
    assert {r.source for r in made[1].rows} == {
        *("random walk", "resolution (quantization)", "bias instability", "rate random walk, not observed"),
        *("rate ramp", "orthogonality", "level", "azimuth", "gravity", "pointing", "mounting"),
    }
    assert contribution(made, "azimuth") == pytest.approx(np.zeros(12), abs=1e-15)  # gravity does not see it
    unseen = next(r for r in made[0].rows if r.source.endswith("not observed"))
    assert (unseen.distribution, unseen.divisor) == ("rectangular", pytest.approx(np.sqrt(3.0)))


N = 4000
SPREAD = 4.5 / np.sqrt(2 * N)
"""Standard deviations of N draws lie within 4.5/√(2N) of the truth: twelve coefficients of five sources at once."""


@pytest.mark.parametrize("process", ["random_walk", "quantization", "bias_instability"])
def test_a_noise_process_alone_gives_its_row(
    fit: tuple[TriadFit, TableErrors], made: tuple[Budget, ...], process: str
) -> None:
    dice, alone = np.random.default_rng(7), NoiseCoefficients(**{process: getattr(NOISE, process)})
    root = np.linalg.cholesky(mean_covariance(alone, WINDOWS))
    clean = VECTORS @ TRUTH[:, 1:].T + TRUTH[:, 0]
    found = [fit[0].estimator.coefficients(clean + root @ dice.normal(size=(12, 3))) - TRUTH.ravel() for _ in range(N)]
    name = {"random_walk": "random walk", "quantization": "resolution (quantization)"}.get(process, "bias instability")
    assert np.std(found, axis=0) == pytest.approx(contribution(made, name), rel=SPREAD)


@pytest.mark.parametrize("source", ["orthogonality", "pointing", "gravity"])
def test_a_flaw_of_the_reference_alone_gives_its_row(
    fit: tuple[TriadFit, TableErrors], made: tuple[Budget, ...], source: str
) -> None:
    dice, table = np.random.default_rng(8), table_errors(ANGLES, VECTORS, DECLARED, of_gravity=True)
    found = []
    for _ in range(N):
        flaws = np.where(table.columns(source), table.sd, 0.0) * dice.normal(size=len(table.sd))
        outputs = (VECTORS + table.sensitivity @ flaws) @ TRUTH[:, 1:].T + TRUTH[:, 0]
        found.append(fit[0].estimator.coefficients(outputs) - TRUTH.ravel())
    expected = contribution(made, source)
    seen = expected > 1e-3 * expected.max()
    assert np.std(found, axis=0)[seen] == pytest.approx(expected[seen], rel=SPREAD)


def test_the_seat_turns_the_rows_of_the_matrix(made: tuple[Budget, ...]) -> None:
    """A unit that sits turned by δ has K·(1 − [δ]×): of row i, column 1 changes by K_i2·δ3 − K_i3·δ2, and so on."""
    sd = DECLARED.mounting_sd_arcsec * ARCSEC
    expected = [np.hypot(k[(j + 1) % 3], k[(j + 2) % 3]) * sd for k in K_ACCELEROMETER for j in range(3)]
    found = contribution(made, "mounting").reshape(3, 4)
    assert found[:, 0] == pytest.approx(np.zeros(3))
    assert found[:, 1:].ravel() == pytest.approx(np.array(expected))


def test_noise_from_the_scatter_has_the_degrees_of_freedom_of_the_fit() -> None:
    table = table_errors(ANGLES, VECTORS, TableUncertainty(), of_gravity=True)
    dice, noise = np.random.default_rng(3), np.array([np.eye(12) * 1e-10] * 3)
    outputs = VECTORS @ TRUTH[:, 1:].T + 3e-5 * dice.normal(size=(12, 3))
    fit = fit_triad("accelerometer", "m/s^2", "m/s^2", VECTORS, outputs, noise, table, noise_known=False)
    (row,) = (made := budgets(fit, [observed_part(fit)], table))[0].rows
    assert (row.source, row.degrees_of_freedom) == (OBSERVED, 24.0)
    assert made[0].degrees_of_freedom == pytest.approx(24.0)
    assert made[0].coverage_factor == pytest.approx(2.11, abs=0.005)  # table G.2: 2.13 at 20, 2.11 at 25
    assert made[0].standard_uncertainty == pytest.approx(fit.calibration().standard_uncertainties[0], rel=1e-9)


@pytest.mark.parametrize(
    ("source", "parameters", "way_out"),
    [
        ("mounting", {}, "mounting_sd_arcsec"),
        ("gravity", {}, "gravity_sd_m_s2"),
        ("thermometers", {}, "thermal_correction=current"),
        ("azimuth", {"azimuth_sd_arcsec": 0.0}, "azimuth_sd_arcsec"),
        ("pointing", {"pointing_sd_arcsec": 0.0}, "pointing_sd_arcsec"),
    ],
)
def test_a_source_without_a_value_is_refused_by_name(source: str, parameters: dict[str, Any], way_out: str) -> None:
    procedure = discover()["calibration_12_orientations"]
    params = procedure.params.model_validate({"budget_sources": [source], **parameters})
    with pytest.raises(BadParameter, match=rf"budget_sources = '?{source}.*{way_out}"):
        procedure.resolve(params, simulated_context())


def test_a_calibration_on_the_bench_has_the_budget_that_it_states() -> None:
    wanted = {
        "budget_sources": ["noise", "azimuth", "gravity", "mounting", "latitude"],
        "gravity_sd_m_s2": 2e-5,
        "latitude_sd_arcsec": 5.0,
    }
    procedure = discover()["calibration_12_orientations"]
    result = run(procedure, seed=5, dwell_s=5.0, settle_s=0.5, mounting_sd_arcsec=3.0, **wanted)
    for triad in result.triads:
        for coefficient, budget in zip(triad.coefficients, triad.budgets, strict=True):
            assert budget.coefficient == coefficient.name
            assert budget.standard_uncertainty == pytest.approx(coefficient.standard_uncertainty, rel=1e-9)
    gyro, force = ({r.source for b in t.budgets for r in b.rows} for t in result.triads)
    assert {"azimuth", "latitude"} <= gyro
    assert "latitude" not in force
    assert {"gravity", "mounting"} <= force
    tables = [s.title for s in procedure.report(result).sections if hasattr(s, "rows")]
    assert "Uncertainty budget of the gyro triad" in tables
