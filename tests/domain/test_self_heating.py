"""Self-heating: the injected curve comes back within its uncertainties, and the bias instability with it."""

import numpy as np
import pytest
from scipy.stats import binom, chi2

from procedures.analysis.allan.deviation import deviation
from procedures.analysis.warm_up.self_heating import SelfHeating, fit_self_heating
from procedures.core.errors import BadParameter, UnfitRecording
from tests.validation.conditioning_noise import ACCELEROMETER, HOURS_6, STATIONARY, noise_cells

TWO = (-60.0, -1.0 / 4000.0, 25.0, -1.0 / 500.0, 10.0)
ONE = (-40.0, -1.0 / 3000.0, 0.0, 0.0, 5.0)
RECORDS = 12
LOW, HIGH = 5e-4, 1.0 - 5e-4


def heating(p: tuple[float, ...], t: np.ndarray) -> np.ndarray:
    return p[0] * np.exp(p[1] * t) + p[2] * np.exp(p[3] * t) + p[4]


@pytest.fixture(scope="module")
def records() -> dict[tuple[float, ...], list[tuple[np.ndarray, np.ndarray, SelfHeating]]]:
    """Noise, cells and fit of some records of each curve, µg."""
    made = {}
    for curve in (TWO, ONE):
        made[curve] = []
        for seed in range(RECORDS):
            noise = noise_cells(ACCELEROMETER.noise, np.random.default_rng([seed, 31]), HOURS_6)
            cells = noise + heating(curve, np.arange(HOURS_6) + 0.5)
            made[curve].append((noise, cells, fit_self_heating(cells, 1.0)))
    return made


def heating_sd(fit: SelfHeating, t_s: np.ndarray) -> np.ndarray:
    """Standard uncertainty of the heating ``F(t) − p₅``, by its gradient over the first four parameters."""
    p1, p2, p3, p4, _ = fit.parameters
    x = t_s - fit.start_s
    first, second = np.exp(p2 * x), np.exp(p4 * x)
    gradient = np.array([first, p1 * x * first, second, p3 * x * second])
    return np.sqrt(np.einsum("it,ij,jt->t", gradient, np.array(fit.covariance)[:4, :4], gradient))


@pytest.mark.parametrize(("curve", "number"), [(TWO, 2), (ONE, 1)])
def test_the_curve_comes_back_within_its_uncertainties(records: dict, curve: tuple[float, ...], number: int) -> None:
    """Every parameter's normalised errors: mean square within chi-square's limits of 0.1 %."""
    fits = [fit for _, _, fit in records[curve]]
    assert [fit.exponentials for fit in fits] == [number] * RECORDS
    there = [i for i in range(5) if curve[i] != 0.0]
    errors = np.array([(np.array(f.parameters) - curve)[there] / f.standard_uncertainties[there] for f in fits])
    low, high = chi2.ppf([LOW, HIGH], RECORDS)
    assert np.all((low <= np.sum(errors**2, axis=0)) & (np.sum(errors**2, axis=0) <= high)), np.std(errors, axis=0)
    t = np.array([60.0, 900.0, 5400.0])
    heat = heating((*curve[:4], 0.0), t)
    along = np.array([(f.curve(t) - f.parameters[4] - heat) / heating_sd(f, t) for f in fits])
    assert np.all((low <= np.sum(along**2, axis=0)) & (np.sum(along**2, axis=0) <= high)), np.std(along, axis=0)


@pytest.mark.parametrize("curve", [TWO, ONE])
def test_the_bias_instability_is_what_it_was_without_heating(records: dict, curve: tuple[float, ...]) -> None:
    """Allan deviation on the plateau at 300 s, of the same noise without and with heating removed.

    A fit of up to four parameters takes its share of 72 clusters: a ratio down to √(1 − 4/72), and 2 % over one.
    """
    for noise, cells, fit in records[curve]:
        before, after, without = (
            float(deviation(y, 1.0, sizes=[300]).deviation[0]) for y in (cells, fit.removed(cells, 1.0), noise)
        )
        assert np.sqrt(1.0 - 4.0 / 72.0) <= after / without <= 1.02
        assert before / without > 1.2


def test_removal_is_about_the_first_moment(records: dict) -> None:
    """Thesis 3.4: the signal keeps its level at t₀, and its noise is untouched."""
    noise, cells, fit = records[ONE][0]
    removed = fit.removed(cells, 1.0)
    t = np.arange(HOURS_6) + 0.5
    assert cells - removed == pytest.approx(fit.curve(t) - fit.curve(np.zeros(1)), abs=1e-6)
    start = noise + heating(ONE, np.zeros(HOURS_6))
    assert np.abs(removed - start).max() < 5 * fit.standard_uncertainties[0]


def test_noise_has_no_heat() -> None:
    """At most 5 %: of 36 records, as many as that would exceed once in a thousand times; and nothing is removed."""
    found = 0
    for channel in STATIONARY:
        for seed in range(6):
            cells = noise_cells(channel.noise, np.random.default_rng([seed, 32]), HOURS_6)
            fit = fit_self_heating(cells, 1.0)
            found += fit.exponentials > 0
            if fit.exponentials == 0:
                assert fit.parameters[:4] == (0.0, 0.0, 0.0, 0.0)
                assert np.array_equal(fit.removed(cells, 1.0), cells)
                assert fit.p_value == 1.0
    assert found <= binom.isf(1e-3, 36, 0.05)


def test_two_equal_exponentials_are_one() -> None:
    cells = noise_cells(ACCELEROMETER.noise, np.random.default_rng(33), HOURS_6)
    t = np.arange(HOURS_6) + 0.5
    fit = fit_self_heating(cells + heating((-30.0, -1 / 2000, -20.0, -1 / 2000, 0.0), t), 1.0)
    assert fit.exponentials == 1
    assert fit.parameters[0] == pytest.approx(-50.0, abs=5 * fit.standard_uncertainties[0])
    assert fit.parameters[2:4] == (0.0, 0.0)


def test_a_late_start_moves_the_curve() -> None:
    cells = noise_cells(ACCELEROMETER.noise, np.random.default_rng(34), HOURS_6)
    cells += heating(ONE, np.arange(HOURS_6) + 0.5)
    early, late = fit_self_heating(cells, 1.0), fit_self_heating(cells[600:], 1.0, start_s=600.0)
    t = np.array([600.0, 3000.0, 10_000.0])
    assert late.curve(t) == pytest.approx(early.curve(t), abs=5 * float(np.max(heating_sd(late, t))))
    assert -1.0 / late.parameters[1] == pytest.approx(3000.0, rel=0.5)


def test_what_cannot_be_fitted_is_refused() -> None:
    cells = np.random.default_rng(35).standard_normal(1000)
    for field, changed in (
        ("cell_s", {"cell_s": -1.0}),
        ("start_s", {"start_s": np.nan}),
        ("significance", {"significance": 0.0}),
    ):
        with pytest.raises(BadParameter) as refused:
            fit_self_heating(cells, **{"cell_s": 1.0, **changed})
        assert refused.value.field == field
    with pytest.raises(UnfitRecording):
        fit_self_heating(np.full(1000, np.inf), 1.0)
