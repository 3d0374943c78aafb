"""The wavelet split: nothing is lost, the rule is the published one, the ends are like the middle."""

import numpy as np
import pytest

from procedures.analysis.wavelet_split import Rule, heursure, most_levels, wavelet_split
from procedures.core import units
from procedures.core.errors import BadParameter, UnfitRecording
from tests.validation.conditioning_noise import SYNTHETIC, noise_cells

RULES: tuple[tuple[Rule, float | None], ...] = (("thesis", 1.0), ("rescaled", None))


def brute_force_threshold(details: np.ndarray) -> float:
    """The rule in words: every |d| tried as threshold, the risk summed term by term (Stein 1981; wden's heursure)."""
    n = len(details)
    universal = np.sqrt(2 * np.log(n))
    if (np.sum(details**2) - n) / n < np.log2(n) ** 1.5 / np.sqrt(n):
        return float(universal)
    risks = [
        (sum(min(abs(d), t) ** 2 for d in details) + n - 2 * sum(abs(d) <= t for d in details), t)
        for t in sorted(abs(details))
    ]
    return float(min(universal, min(risks)[1]))


@pytest.mark.parametrize("size", [0.3, 1.0, 1.2, 2.0, 10.0, 200.0])
@pytest.mark.parametrize("n", [30, 257])
def test_the_threshold_is_the_published_one(n: int, size: float) -> None:
    rng = np.random.default_rng(n)
    details = size * rng.standard_normal(n) + np.where(rng.random(n) < 0.05, 20.0, 0.0)
    assert heursure(details) == pytest.approx(brute_force_threshold(details), rel=1e-12)


def test_the_threshold_by_hand() -> None:
    """n = 4, d² = 0, 1, 4, 100: η = 25.25 > 2^1.5/2; risks at those four 2, 3, 7, 101. And small details: universal."""
    assert heursure(np.array([0.0, -1.0, 2.0, 10.0])) == 0.0
    assert heursure(np.array([0.1, -0.1, 0.1, 0.1])) == pytest.approx(np.sqrt(2 * np.log(4)))


@pytest.mark.parametrize(("rule", "unit_size"), RULES)
@pytest.mark.parametrize("count", [1000, 1001, 21_600])
def test_nothing_is_lost(rule: Rule, unit_size: float | None, count: int) -> None:
    cells = 15.04 + noise_cells(SYNTHETIC.noise, np.random.default_rng(2), count)
    split = wavelet_split(cells, 1.0, rule=rule, unit_size=unit_size, levels=5)
    assert split.kept.shape == split.removed.shape == cells.shape
    assert np.abs(split.kept + split.removed - cells).max() <= 4 * np.finfo(float).eps * np.abs(cells).max()
    assert np.std(split.removed) > 0.0
    assert [level.number for level in split.levels] == [1, 2, 3, 4, 5]
    assert (split.levels[-1].from_s, split.levels[-1].to_s) == (16.0, 32.0)


def test_units_matter_to_the_thesis_rule_and_are_named() -> None:
    """The same record in rad/s is split as in deg/h when told what one is, and hardly at all when told otherwise."""
    cells = noise_cells(SYNTHETIC.noise, np.random.default_rng(3), 4096)
    in_deg_h = wavelet_split(cells, 1.0, rule="thesis", unit_size=1.0)
    in_si = wavelet_split(cells * units.DEG_PER_HOUR, 1.0, rule="thesis", unit_size=units.DEG_PER_HOUR)
    assert in_si.kept == pytest.approx(in_deg_h.kept * units.DEG_PER_HOUR, rel=1e-9, abs=1e-12 * units.DEG_PER_HOUR)
    other = wavelet_split(cells, 1.0, rule="thesis", unit_size=0.001)
    assert np.std(other.removed) < 0.02 * np.std(in_deg_h.removed)
    for size in (1.0, units.DEG_PER_HOUR):
        rescaled = wavelet_split(cells * size, 1.0, rule="rescaled")
        assert rescaled.kept / size == pytest.approx(wavelet_split(cells, 1.0, rule="rescaled").kept, abs=1e-9)


def test_white_noise_alone_is_removed_by_its_own_level() -> None:
    """Universal threshold of 2¹⁵ pure noise: what is kept is the approximation, one part in 2⁶ of the power."""
    cells = 3.0 * np.random.default_rng(4).standard_normal(1 << 15)
    split = wavelet_split(cells, 1.0, rule="rescaled")
    for level in split.levels:  # a median of n details scatters by 1.17/√n of itself
        assert level.noise == pytest.approx(3.0, rel=5 * 1.17 / np.sqrt(level.details))
    # 512 coefficients and more of variance one: 5 standard deviations of √(2/512), and details that pass
    assert np.var(split.kept) / 9.0 == pytest.approx(2.0**-6, rel=5 * np.sqrt(2 / 512) + 0.05)


@pytest.mark.parametrize(("rule", "unit_size"), RULES)
def test_the_ends_are_like_the_middle(rule: Rule, unit_size: float | None) -> None:
    """Removed power in the first and last 64 of 4096 cells against the middle, over 60 records.

    The mirrored end makes neither a step nor a hole. 7680 removed samples, neighbours tied together over a few: 5
    standard deviations of √(2·4/7680).
    """
    ends, middle = [], []
    for seed in range(60):
        cells = noise_cells(SYNTHETIC.noise, np.random.default_rng([seed, 5]), 4096)
        squares = wavelet_split(cells + 3.0, 1.0, rule=rule, unit_size=unit_size).removed ** 2
        ends.append(np.mean(np.concatenate([squares[:64], squares[-64:]])))
        middle.append(np.mean(squares[1024:3072]))
    assert np.mean(ends) / np.mean(middle) == pytest.approx(1.0, abs=5 * np.sqrt(8 / 7680))


def test_a_slow_signal_is_kept_to_its_ends() -> None:
    """A drift far above the noise: what is removed stays noise, at the ends as well."""
    rng = np.random.default_rng(6)
    drift = 50.0 * np.exp(-np.arange(4096) / 1500.0)
    split = wavelet_split(drift + 0.1 * rng.standard_normal(4096), 1.0, rule="rescaled")
    # an averaged noise of 0.1 is below 0.1 everywhere; 6 of its sd, were nothing averaged at all
    assert np.abs(split.kept - drift).max() < 0.6


def test_what_cannot_be_split_is_refused() -> None:
    cells = np.random.default_rng(7).standard_normal(300)
    with pytest.raises(BadParameter, match="levels = 6: 1 to 4, for 300 cells and sym8"):
        wavelet_split(cells, 1.0, rule="rescaled")
    for field, changed in (
        ("unit_size", {"rule": "thesis"}),
        ("unit_size", {"rule": "rescaled", "unit_size": 1.0}),
        ("unit_size", {"rule": "thesis", "unit_size": 0.0}),
        ("rule", {"rule": "sqtwolog"}),
        ("wavelet", {"rule": "rescaled", "wavelet": "bior4.4"}),
        ("wavelet", {"rule": "rescaled", "wavelet": "sym21"}),
        ("levels", {"rule": "rescaled", "levels": 0}),
        ("cell_s", {"rule": "rescaled", "cell_s": 0.0}),
    ):
        with pytest.raises(BadParameter) as refused:
            wavelet_split(cells, **{"cell_s": 1.0, "levels": 4, **changed})  # pyright: ignore[reportArgumentType]
        assert refused.value.field == field
    with pytest.raises(UnfitRecording, match="finite"):
        wavelet_split(np.append(cells, np.nan), 1.0, rule="rescaled", levels=4)


@pytest.mark.parametrize("levels", [1, 4, 6])
def test_the_shortest_series_is_the_shortest_that_can_be_split(levels: int) -> None:
    """``2^levels·(filter − 1)`` cells, by PyWavelets' own rule; sym8 has a filter of 16."""
    cells = np.sin(np.arange(15 * 2**levels))
    assert (most_levels(len(cells)), most_levels(len(cells) - 1)) == (levels, levels - 1)
    wavelet_split(cells, 2.0, rule="rescaled", levels=levels)
    with pytest.raises(BadParameter, match="levels"):
        wavelet_split(cells[:-1], 2.0, rule="rescaled", levels=levels)
