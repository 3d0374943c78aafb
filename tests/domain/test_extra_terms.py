"""K₂, asymmetry and g-sensitivity: exact without noise, as spread as claimed with it, refused where not determined."""

import numpy as np
import pytest
from scipy.stats import binom, chi2

from procedures.analysis.calibration.extra_terms import CLAIMED, Kind, fit_terms, named, require_terms, terms_of
from procedures.analysis.calibration.multiposition import fit_triad
from procedures.analysis.calibration.table_errors import TableErrors, TableUncertainty, table_errors
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, Undetermined
from procedures.core.frames import earth_rate_b, specific_force_b
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles

SITE = Site(latitude_deg=50.0, gravity_m_s2=9.81, azimuth_deg=0.0)
ANGLES = [
    TableAngles(outer, middle, inner)
    for outer in (0.0, 70.0)
    for middle in (0.0, 45.0, 90.0, -90.0, 180.0, -135.0)
    for inner in (0.0, 90.0, -45.0, 180.0)
]
FORCES, RATES = specific_force_b(ANGLES, SITE), earth_rate_b(ANGLES, SITE)
NO_FLAWS = TableErrors(np.zeros((len(ANGLES), 3, 0)), np.zeros(0), ())
MATRIX = np.eye(3) + 1e-3 * np.array([[0.4, 1.0, -2.0], [0.5, -0.3, 1.5], [-1.0, 0.7, 0.2]])
BIAS = np.array([1e-3, -2e-3, 5e-4])
SD = 2e-5


def noise(n: int, sd: float) -> Array:
    return np.array([np.eye(n) * sd**2] * 3)


def accelerometer_outputs(quadratic: float, asymmetry: float) -> Array:
    return BIAS + FORCES @ MATRIX.T + quadratic * FORCES**2 + asymmetry * np.abs(FORCES)


def test_without_noise_every_coefficient_is_exact() -> None:
    terms = terms_of(("quadratic", "asymmetry"), FORCES, None)
    fit = fit_terms(
        "the coefficients",
        FORCES,
        accelerometer_outputs(3e-6, -1e-5),
        noise(len(ANGLES), SD),
        NO_FLAWS,
        terms,
        ("m/s^2", "m/s^2"),
    )
    found = named(fit)
    assert found["K2_x"] == pytest.approx(3e-6, abs=1e-13)
    assert found["KA_z"] == pytest.approx(-1e-5, abs=1e-12)
    np.testing.assert_allclose(fit.coefficients.reshape(3, 4)[:, 1:], MATRIX, atol=1e-12)
    np.testing.assert_allclose(fit.coefficients.reshape(3, 4)[:, 0], BIAS, atol=1e-11)
    assert {t.unit for t in fit.terms} == {"m/s^2/(m/s^2)^2", "1"}


def test_without_terms_it_is_the_linear_calibration() -> None:
    rng = np.random.default_rng(3)
    outputs = accelerometer_outputs(0.0, 0.0) + SD * rng.normal(size=FORCES.shape)
    table = table_errors(ANGLES, FORCES, TableUncertainty(2.0, 1.0, 3.0, 10.0, 1e-6), of_gravity=True)
    plain = fit_triad("accelerometer", "m/s^2", "m/s^2", FORCES, outputs, noise(len(ANGLES), SD), table)
    fit = fit_terms("them", FORCES, outputs, noise(len(ANGLES), SD), table, (), ("m/s^2", "m/s^2"))
    np.testing.assert_allclose(fit.coefficients, plain.coefficients, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(fit.covariance, plain.covariance, rtol=1e-6, atol=1e-22)
    assert fit.chi_square == pytest.approx(plain.chi_square, rel=1e-6)


@pytest.mark.parametrize("known", [True, False])
def test_the_terms_scatter_as_they_claim_and_absent_ones_are_seldom_claimed(known: bool) -> None:
    """150 units, three K2 present and three KA absent. Σ(error/sd)² is χ² of 450 for the three independent channels
    where the noise is known; found from 120 residuals, its variance grows by 2·450²/120 (one factor for a unit:
    2·3²/120 a unit) and its mean by 120/118. Bounds at four standard deviations; claims by the binomial law.
    """
    rng = np.random.default_rng(8)
    terms = terms_of(("quadratic", "asymmetry"), FORCES, None)
    units_, present, false = 150, [], 0
    for _ in range(units_):
        outputs = accelerometer_outputs(4e-6, 0.0) + SD * rng.normal(size=FORCES.shape)
        given = SD if known else 1e-3 * SD
        fit = fit_terms("them", FORCES, outputs, noise(len(ANGLES), given), NO_FLAWS, terms, ("m/s^2", "m/s^2"), known)
        present.append([(t.estimate - 4e-6) / t.standard_uncertainty for t in fit.terms[:3]])
        false += sum(t.present for t in fit.terms[3:])
        assert (fit.p_value is None) == (not known)
    total, degrees = float(np.sum(np.square(present))), fit.degrees_of_freedom
    if known:
        assert chi2.ppf(3e-5, 3 * units_) < total < chi2.ppf(1.0 - 3e-5, 3 * units_)
    else:
        spread = np.sqrt(2.0 * 3 * units_ + units_ * 2.0 * 9 / degrees)
        assert abs(total - 3 * units_ * degrees / (degrees - 2)) < 4.0 * spread
    assert false <= binom.ppf(1.0 - 1e-4, 3 * units_, CLAIMED)


def test_a_gyros_sensitivity_to_specific_force_is_found_beside_its_matrix() -> None:
    """A tenth of a degree an hour a g of x along y; noise of a ten-minute dwell at 0.002 deg/√h."""
    rng, sd = np.random.default_rng(4), 0.005 * units.DEG_PER_HOUR
    true = 0.1 * units.DEG_PER_HOUR / 9.81
    outputs = BIAS * 1e-4 + RATES @ MATRIX.T + sd * rng.normal(size=RATES.shape)
    outputs[:, 0] += true * FORCES[:, 1]
    fit = fit_terms(
        "them",
        RATES,
        outputs,
        noise(len(ANGLES), sd),
        NO_FLAWS,
        terms_of(("g_sensitivity",), RATES, FORCES),
        ("rad/s", "rad/s"),
    )
    by_name = {t.name: t for t in fit.terms}
    assert by_name["G_xy"].present
    assert abs(by_name["G_xy"].estimate - true) < 4.0 * by_name["G_xy"].standard_uncertainty < true
    assert len(by_name) == 9


def faces() -> Array:
    return 9.81 * np.vstack([np.eye(3), -np.eye(3)])


@pytest.mark.parametrize(
    ("kinds", "vectors", "sentence"),
    [
        (("quadratic", "asymmetry"), faces(), "of two sizes, such as 45° and 90°"),
        (("quadratic",), faces()[:5], "three different inputs at least"),
    ],
)
def test_what_the_positions_cannot_determine_is_refused_with_the_way_out(
    kinds: tuple[Kind, ...], vectors: Array, sentence: str
) -> None:
    with pytest.raises(Undetermined) as refusal:
        require_terms("the coefficients", vectors, terms_of(kinds, vectors, None))
    assert sentence in str(refusal.value)
    assert "lost: " in str(refusal.value)


def test_six_faces_determine_the_quadratic_term() -> None:
    assert require_terms("them", faces(), terms_of(("quadratic",), faces(), None)) < 10.0


def test_an_accelerometer_has_no_sensitivity_to_its_own_input() -> None:
    with pytest.raises(BadParameter, match="the gyros' only"):
        terms_of(("g_sensitivity",), FORCES, None)
