"""The library at a prompt: other implementations, closed forms, arguments as people have them, refusals in words."""

import contextlib

import allantools
import numpy as np
import pytest
from scipy.stats import chi2

import procedures.library as inertial
from procedures.core.units import DEG_PER_SQRT_HOUR

GRAVITY = 9.81
SIX_FACES = np.vstack([np.eye(3), -np.eye(3)])
TILTED = np.array([[1, 1, 1], [1, -1, 1], [-1, 1, 1], [1, 1, -1], [-1, -1, 1], [1, -1, -1]]) / np.sqrt(3.0)
POSES = GRAVITY * np.vstack([SIX_FACES, TILTED])
BIAS = np.array([12.0, -7.0, 3.0])
MATRIX = np.array([[20000.0, 30.0, -40.0], [15.0, 20100.0, 25.0], [-35.0, 10.0, 19900.0]])
NOISE = 0.5
SOAKS_C = np.array([-40.0, -20.0, 0.0, 20.0, 40.0, 60.0])


def _white(count: int) -> np.ndarray:
    return 1e-4 * np.random.default_rng(1).normal(size=count)


def _upright(seed: int) -> np.ndarray:
    """Twenty poses within some 20 degrees of upright, of a channel with a scale factor of one."""
    chance = np.random.default_rng(seed)
    directions = np.column_stack([0.15 * chance.normal(size=(20, 2)), np.ones(20)])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return [0.05, -0.03, 0.08] + GRAVITY * directions + 5e-3 * chance.normal(size=(20, 3))


class Labelled:
    """Samples behind another library's object, as a column of a data frame is: numpy asks it for an array."""

    def __init__(self, values: np.ndarray) -> None:
        self._values = values

    def __array__(self, dtype: object = None, copy: bool | None = None) -> np.ndarray:
        return self._values


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20)


@pytest.mark.parametrize(
    ("statistic", "theirs"),
    [
        ("allan", allantools.adev),
        ("overlapping_allan", allantools.oadev),
        ("modified_allan", allantools.mdev),
        ("time", allantools.tdev),
        ("hadamard", allantools.hdev),
        ("overlapping_hadamard", allantools.ohdev),
    ],
)
def test_deviations_are_those_of_allantools(statistic: str, theirs, rng: np.random.Generator) -> None:
    """Both are exact sums: what differs is rounding, far below one in 10⁸ at 20,000 samples."""
    y = rng.normal(size=20_000) + 1e-3 * rng.normal(size=20_000).cumsum()
    ours = inertial.allan(y, 50.0, statistic, points=12)
    tau, expected, *_ = theirs(y, 50.0, "freq", ours.tau_s)
    shown = np.isin(np.round(ours.tau_s * 50.0), np.round(tau * 50.0))
    assert shown.sum() >= 10
    np.testing.assert_allclose(ours.deviation[shown], expected, rtol=1e-8)


@pytest.mark.parametrize("shape", [list, tuple, np.asarray, Labelled, lambda y: y[:, None]])
def test_samples_are_taken_as_people_have_them(shape, rng: np.random.Generator) -> None:
    y = rng.normal(size=500)
    np.testing.assert_array_equal(inertial.allan(shape(y), 1.0).deviation, inertial.allan(y, 1.0).deviation)


def test_a_family_is_what_each_statistic_gives_by_itself(rng: np.random.Generator) -> None:
    y = rng.normal(size=2000)
    found = inertial.allan_family(y, 50.0, points=12)
    assert {"allan", "overlapping_allan", "modified_allan", "time", "hadamard", "overlapping_hadamard"} == set(found)
    for name, curve in found.items():
        alone = inertial.allan(y, 50.0, name, points=12)
        assert curve.statistic == name
        for values in ("tau_s", "deviation", "lower", "upper", "edf", "terms"):
            np.testing.assert_allclose(getattr(curve, values), getattr(alone, values), rtol=1e-12)
    assert list(inertial.allan_family(y, 50.0, ["time", "allan"])) == ["time", "allan"]


def test_increments_are_rates_times_the_sample_period(rng: np.random.Generator) -> None:
    y = rng.normal(size=4000)
    rates, increments = inertial.allan(y, 100.0), inertial.allan(y / 100.0, 100.0, increments=True)
    np.testing.assert_allclose(increments.deviation, rates.deviation, rtol=1e-12)


def test_white_noise_has_its_random_walk_and_nothing_else(rng: np.random.Generator) -> None:
    """N = σ/√rate. Four standard uncertainties: one in 16,000 seeds would fail."""
    sd_deg_h, rate_hz = 3.0, 100.0
    found = inertial.noise(sd_deg_h * rng.normal(size=120_000), rate_hz, unit="deg/h")
    walk = found.coefficients["N"]
    truth = sd_deg_h / np.sqrt(rate_hz) / 60.0 * DEG_PER_SQRT_HOUR
    assert abs(walk.value - truth) < 4.0 * walk.standard_uncertainty < 0.02 * truth
    assert [letter for letter, c in found.coefficients.items() if c.value is not None] == ["N"]
    assert str(found).splitlines()[1].startswith("N 0.00")


def test_increments_in_a_unit_give_the_same_noise(rng: np.random.Generator) -> None:
    y = rng.normal(size=20_000)
    rates, increments = (
        inertial.noise(y, 100.0, unit="µg"),
        inertial.noise(y / 100.0, 100.0, unit="µg", increments=True),
    )
    assert increments.coefficients["N"].value == pytest.approx(rates.coefficients["N"].value, rel=1e-9)


def test_exact_outputs_give_the_exact_coefficients() -> None:
    found = inertial.calibrate(BIAS + POSES @ MATRIX.T, POSES, NOISE)
    np.testing.assert_allclose(found.bias, BIAS, atol=1e-7)
    np.testing.assert_allclose(found.matrix, MATRIX, atol=1e-8)
    np.testing.assert_allclose(found.correct(BIAS + POSES @ MATRIX.T), POSES, atol=1e-12)


@pytest.mark.parametrize("given", [NOISE, None])
def test_calibrations_scatter_as_they_claim(given: float | None, rng: np.random.Generator) -> None:
    """Σ(error/sd)² over 200 calibrations, b of three channels each, against its own law.

    Known noise: χ² of 600. Unknown noise is found from 24 residuals: each square is F(1, 24), mean 24/22 and variance
    2·24²·23/(22²·20), and the three of one calibration share that estimate (covariance 2·24²/(22²·20) of each pair).
    The noise is scaled up, never down, from far below: no bias. Both bounds are four standard deviations.
    """
    errors = []
    for _ in range(200):
        outputs = BIAS + POSES @ MATRIX.T + NOISE * rng.normal(size=POSES.shape)
        found = inertial.calibrate(outputs, POSES, given)
        errors.append((found.bias - BIAS) / [found.sd[f"b_{axis}"] for axis in "xyz"])
        assert (found.p_value is None) == (given is None)
    total = float(np.sum(np.square(errors)))
    if given is not None:
        assert chi2.ppf(3e-5, 600) < total < chi2.ppf(1.0 - 3e-5, 600)
    else:
        each, pair = 2.0 * 24**2 * 23 / (22**2 * 20), 2.0 * 24**2 / (22**2 * 20)
        spread = np.sqrt(200 * (3 * each + 6 * pair))
        assert abs(total - 600 * 24 / 22) < 4.0 * spread


def test_the_magnitude_alone_corrects_to_the_magnitude() -> None:
    outputs = BIAS + POSES @ MATRIX.T
    found = inertial.scalar(outputs, GRAVITY, NOISE)
    np.testing.assert_allclose(np.linalg.norm(found.correct(outputs), axis=1), GRAVITY, rtol=1e-11)
    assert found.sd["K21"] == found.sd["K31"] == found.sd["K32"] == 0.0


def test_a_fit_that_does_not_describe_the_poses_says_so(rng: np.random.Generator) -> None:
    outputs = 0.02 + POSES @ MATRIX.T / 20_000 + 5e-4 * rng.normal(size=POSES.shape)
    assert inertial.calibrate(outputs, POSES, 5e-4).warnings == ()
    assert inertial.scalar(outputs, GRAVITY, 5e-4).warnings == ()
    for clipped in (
        inertial.calibrate(np.clip(outputs, -9.0, 9.0), POSES, 5e-4),
        inertial.scalar(np.clip(outputs, -9.0, 9.0), GRAVITY, 5e-4),
    ):
        assert "the poses do not fit: chi-square" in str(clipped)
    reversed_z = inertial.calibrate(outputs * [1.0, 1.0, -1.0], POSES, 5e-4)
    assert len(reversed_z.warnings) == 1
    assert reversed_z.warnings[0].startswith("channel z answers its own axis with -0.99")


@pytest.mark.parametrize("seed", range(2))
def test_poses_on_one_side_give_no_other_units_numbers(seed: int) -> None:
    """A wide cap determines them; a narrow one is refused, or right within what it claims. Never a false minimum."""
    for spread in (0.15, 0.4, 1.5):
        chance = np.random.default_rng(seed)
        directions = np.column_stack([spread * chance.normal(size=(24, 2)), np.ones(24)])
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        outputs = [0.05, -0.03, 0.08] + GRAVITY * directions + 1e-3 * chance.normal(size=(24, 3))
        try:
            found = inertial.scalar(outputs, GRAVITY, 1e-3)
        except inertial.Undetermined:
            assert spread < 1.0
            continue
        # Of 2·3 fits with 6 coefficients each, 4.5 standard uncertainties are exceeded once in a thousand runs.
        away = np.array([*(found.bias - [0.05, -0.03, 0.08]), *(np.diagonal(found.matrix) - 1.0)])
        assert np.all(np.abs(away) < 4.5 * np.array([found.sd[k] for k in ("b_x", "b_y", "b_z", "K11", "K22", "K33")]))


def test_a_polynomial_is_that_of_numpy(rng: np.random.Generator) -> None:
    t = np.linspace(-40.0, 60.0, 11)
    values = 5.0 + 0.01 * (t - 20.0) + 2e-4 * (t - 20.0) ** 2 + 0.01 * rng.normal(size=11)
    found = inertial.thermal(t, values)
    expected, covariance = np.polyfit(t - 20.0, values, 2, cov=True)
    np.testing.assert_allclose([*found.fit.coefficients[::-1], found.fit.at_reference], expected, rtol=1e-9)
    gradient = np.vander(t - 20.0, 3)
    np.testing.assert_allclose(found(t), gradient @ expected, rtol=1e-9)
    np.testing.assert_allclose(found.sd(t), np.sqrt(np.diag(gradient @ covariance @ gradient.T)), rtol=1e-8)


def test_a_relative_polynomial_claims_the_same_uncertainty_of_its_values(rng: np.random.Generator) -> None:
    t = np.linspace(-40.0, 60.0, 11)
    values = 5.0 + 0.01 * (t - 20.0) + 0.01 * rng.normal(size=11)
    plain, relative = inertial.thermal(t, values), inertial.thermal(t, values, relative=True)
    np.testing.assert_allclose(relative(t), plain(t), rtol=1e-10)
    np.testing.assert_allclose(relative.sd(t), plain.sd(t), rtol=1e-8)


def test_both_parts_of_a_split_are_the_record(rng: np.random.Generator) -> None:
    y = np.sin(np.arange(2000) / 200.0) + 0.3 * rng.normal(size=2000)
    found = inertial.split(y, 10.0)
    np.testing.assert_allclose(found.kept + found.removed, y, atol=1e-12)
    assert np.std(found.kept - np.sin(np.arange(2000) / 200.0)) < 0.1


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: inertial.allan([1.0, 2.0], 0.0), "rate_hz = 0.0: a finite number above zero"),
        (lambda: inertial.allan(np.zeros((4, 3)), 1.0), "one channel at a time"),
        (lambda: inertial.allan(["a"], 1.0), "y = 'list': numbers only"),
        (lambda: inertial.allan([], 1.0), "at least one sample"),
        (lambda: inertial.allan([1.0], 1.0), "has no term of so few"),
        (lambda: inertial.allan([1.0, np.nan, *range(20)], 1.0), "sample 1"),
        (lambda: inertial.allan(range(9), 1.0, "alan"), "one of allan, overlapping_allan"),
        (lambda: inertial.allan(range(9), 1.0, confidence=95), "between 0 and 1"),
        (lambda: inertial.allan_family(range(9), 1.0, ["allan", "alan"]), "one of allan, overlapping_allan"),
        (lambda: inertial.allan_family([1.0, np.nan, *range(20)], 1.0), "sample 1"),
        (lambda: inertial.noise(range(9), 1.0, unit="rpm"), "one of rad/s, deg/s, deg/h"),
        (lambda: inertial.noise(range(9), 1.0), "9 samples are too few"),
        (lambda: inertial.noise(range(9), 1.0, cell_s=0.1), "at least 1 s, one sample"),
        (lambda: inertial.noise(_white(11_990), 100.0), "record at least 120 s, or make cell_s shorter, 0.9 at"),
        (lambda: inertial.noise(_white(110), 1.0), "at least 120 are needed: record at least 120 s"),
        (lambda: inertial.split([1.0, 2.0], 1.0), "more samples"),
        (lambda: inertial.split(range(999), 1.0, wavelet="sym"), "an orthogonal one: haar"),
        (lambda: inertial.calibrate(POSES[:, :2], POSES), "a row of x, y, z for each pose"),
        (lambda: inertial.calibrate(POSES, POSES[:5]), "as many as there are poses, 12"),
        (lambda: inertial.calibrate(POSES, POSES, sd=-1.0), "finite numbers above zero"),
        (lambda: inertial.calibrate(POSES, POSES, sd=[1.0, 2.0]), "one for each channel (3,)"),
        (lambda: inertial.calibrate(POSES, POSES, triad="magnetometer"), "one of accelerometer, gyro"),
        (lambda: inertial.calibrate(POSES[:3], POSES[:3], 1.0), "rank 3 of 4"),
        (lambda: inertial.scalar(POSES[:6], GRAVITY, 1.0), "lost: "),
        (lambda: inertial.scalar(POSES, float("nan")), "magnitude = nan"),
        (lambda: inertial.thermal([1.0, 2.0], [1.0]), "as many as there are temperatures, 2"),
        (lambda: inertial.thermal([1.0, 2.0], [1.0, 2.0]), "2 soaks cannot give a polynomial of order 2"),
        (lambda: inertial.thermal(SOAKS_C, SOAKS_C - 20.0, relative=True), "zero within its uncertainty"),
        (lambda: inertial.calibrate(POSES * [1.0, 1.0, 0.0], POSES), "accelerometer z changes by 0 of the output"),
        (lambda: inertial.scalar(POSES * [1.0, 0.0, 1.0], GRAVITY), "accelerometer y changes by 0 of the output"),
        (lambda: inertial.scalar(_upright(1), GRAVITY, 5e-3), "b_z (± "),
        (lambda: inertial.load("absent.csv"), "absent.csv cannot be read"),
    ],
)
def test_what_cannot_be_is_refused_in_words(ask, sentence: str) -> None:
    with pytest.raises(inertial.DomainError) as refusal:
        ask()
    assert sentence in str(refusal.value)


def test_a_name_that_is_not_there_lists_those_that_are() -> None:
    with pytest.raises(AttributeError, match="it has BadParameter, Calibration"):
        inertial.alan  # noqa: B018
    assert set(inertial.__all__) == set(dir(inertial))
    assert all(getattr(inertial, name) is not None for name in inertial.__all__)


def test_every_result_can_be_drawn(rng: np.random.Generator) -> None:
    y = rng.normal(size=2000)
    outputs = BIAS + POSES @ MATRIX.T + NOISE * rng.normal(size=POSES.shape)
    drawn = (
        inertial.allan(y, 1.0),
        inertial.noise(y, 10.0),
        inertial.split(y, 1.0),
        inertial.calibrate(outputs, POSES),
        inertial.scalar(outputs, GRAVITY),
        inertial.thermal(range(6), y[:6]),
    )
    for result in drawn:
        axes = result.plot()
        assert axes.get_xlabel()
        assert axes.lines
        assert result.plot(axes) is axes


@pytest.mark.parametrize(
    "signal",
    [
        lambda i: 1e-7 * i,
        lambda i: 1e-12 * i**2,
        lambda i: 1e-3 * np.sin(0.647 * i),
        lambda i: np.exp(-i / 5000.0),
        lambda i: i + 0.2 * (i % 3),
        lambda i: (i > 7000) * 1e-3,
        lambda i: i % 2,
    ],
)
def test_a_record_without_noise_is_refused_or_gives_limits_but_crashes_no_fit(signal) -> None:
    with contextlib.suppress(inertial.DomainError):
        found = inertial.noise(signal(np.arange(15_000.0)), 100.0, unit="rad/s")
        assert found.coefficients["N"].value is None
