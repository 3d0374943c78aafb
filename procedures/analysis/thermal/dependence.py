"""Dependence of any channel on a temperature: one polynomial over several recordings, soak by soak, and repeatability.

The thesis's program (appendix B: `approxPart`, `normalize`, `plotApproxCoefFiles`) fits polynomials of order 1 … 5 to
the soaks of each file, relative to the soak of normal conditions, and compares them over the files. Here each recording
has an intercept of its own, the noise is the channel's own slow one, and every figure has its uncertainty.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from procedures.analysis.coloured_noise import cosines, unit_variances
from procedures.analysis.thermal.correlated import LinearFit, Spectrum, fit_linear, spectrum, whiten
from procedures.analysis.thermal.correlation import correlation
from procedures.analysis.thermal.order import LARGEST_ORDER, Order, compare_orders
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.noise import NoiseCoefficients

SMALLEST_P = 1e-300


@dataclass(frozen=True)
class Series:
    """Cell means of one recording's channel, the departure of its temperature from the reference, and its regime."""

    values: Array
    """Channel, (n,)."""
    departure_c: Array
    """Temperature less the reference, (n,)."""
    dynamic: NDArray[np.bool_] | None = None
    """True where the temperature moves; None where soaks are not asked for."""


def designs(series: Sequence[Series], order: int) -> list[Array]:
    """Return the design of each recording: intercepts of the recordings, then the powers, (n, recordings + order)
    each.
    """
    found: list[Array] = []
    for index, one in enumerate(series):
        heads = np.zeros((len(one.values), len(series)))
        heads[:, index] = 1.0
        found.append(np.column_stack([heads, one.departure_c[:, None] ** np.arange(1, order + 1)]))
    return found


def fit_order(series: Sequence[Series], order: int, cell_s: float) -> LinearFit:
    """Return the fit of a polynomial by generalised least squares with the residuals' own noise. Raises
    `UnfitRecording`.
    """
    values = [s.values for s in series]
    return fit_linear(designs(series, order), values, [np.ones(len(v)) for v in values], cell_s)


def judge_order(series: Sequence[Series], cell_s: float) -> Order:
    """Compare the orders on cells whitened by the noise that the largest of each recording's own leaves.

    A smaller one's would hold misfit, and a common one's what does not repeat. Raises `UnfitRecording` where nothing is
    left of the cells.
    """
    found = _own_spectrum(series, LARGEST_ORDER, cell_s)
    spread = zip(designs(series, LARGEST_ORDER), series, found.variances, strict=True)
    pairs = [(whiten(d, v), whiten(s.values, v)) for d, s, v in spread]
    columns, values = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    sets = [list(range(len(series) + order)) for order in range(1, LARGEST_ORDER + 1)]
    return compare_orders(columns, sets, values, len(values) / found.inflation, float(len(values)))


def _own_spectrum(series: Sequence[Series], order: int, cell_s: float) -> Spectrum:
    return spectrum([fit_order([one], order, cell_s).residuals[0] for one in series], cell_s)


def own_noise(series: Sequence[Series], order: int, cell_s: float) -> NoiseCoefficients:
    """Noise of what each recording's own polynomial leaves: what does not repeat from one to the next is no noise.

    Raises `UnfitRecording`.
    """
    return _own_spectrum(series, max(order, 2), cell_s).noise


def joint_p_value(series: Sequence[Series], cell_s: float, noise: NoiseCoefficients | None = None) -> float:
    """Return the p-value of the hypothesis that no recording depends on temperature, by Fisher's ``−2·Σ ln p``.

    `series`: cell means of one channel, a recording each. `noise`: of the channel; None: the most likely one of each
    recording (`correlation`). Raises `UnfitRecording`.
    """
    found = [correlation(s.values, s.departure_c, cell_s, noise).p_value for s in series]
    return float(chdtrc(2 * len(found), -2.0 * sum(log(max(p, SMALLEST_P)) for p in found)))


def unseen_p_value(
    series: Sequence[Series], order: int, cell_s: float, noise: NoiseCoefficients | None = None
) -> float | None:
    """Return the joint p-value of what a fit to all other recordings leaves in each; None with a single recording.
    `noise` as in `joint_p_value`.
    """
    if len(series) < 2:
        return None
    left: list[Series] = []
    for index, one in enumerate(series):
        others = [s for i, s in enumerate(series) if i != index]
        slopes = fit_order(others, order, cell_s).coefficients[len(others) :]
        curve = one.departure_c[:, None] ** np.arange(1, order + 1) @ slopes
        left.append(replace(one, values=one.values - curve))
    return joint_p_value(left, cell_s, noise)


@dataclass(frozen=True)
class SoakFit:
    """Fit of a channel within one soak of one recording."""

    recording: int
    temperature_c: float
    """Mean of the sensor."""
    from_below: bool | None
    """True if the soak before was colder, False if it was warmer; None for a recording's first."""
    level: float
    """Mean less that of the recording's reference soak, brought to no other temperature."""
    level_sd: float
    slope: float | None
    """Slope by temperature within the soak; None where the temperature stood still."""
    slope_sd: float | None
    preferred_order: int | None
    """Order of 1 … 5 that the criterion prefers within the soak; None where the temperature stood still."""


@dataclass(frozen=True)
class Repeatability:
    """Levels of one soak over several recordings, or over several visits in one."""

    temperature_c: float
    count: int
    spread: float
    """Sample standard deviation, n − 1."""
    expected: float
    """Spread that the levels' own uncertainties give."""
    p_value: float
    """Chance of as much spread from these alone."""
    up_less_down: float | None
    """Mean level reached from below less that reached from above; None where one way is missing."""
    up_less_down_sd: float | None


MOVED_C = 0.05
"""Range of the temperature within a soak below which no slope is sought."""


def soak_fits(
    series: Sequence[Series], noise: NoiseCoefficients, cell_s: float, reference_c: float, least_s: float
) -> tuple[SoakFit, ...]:
    """Levels and slopes soak by soak. `reference_c`: temperature less the series' own reference (0: at it).

    A soak is a stretch in which the temperature is static for at least `least_s` [s]. Uncertainties of contrasts are
    ``Σ C²·s`` with the cosines' variances s of `noise`. Raises `BadParameter`, `UnfitRecording` without any soak.
    """
    if not 0.0 < least_s < np.inf:
        raise BadParameter("least_soak_s", least_s, "finite and above 0")
    found: list[SoakFit] = []
    squares = np.square([noise.quantization, noise.random_walk, noise.bias_instability, noise.rate_random_walk])
    for index, one in enumerate(series):
        spans = _static(one, max(2, round(least_s / cell_s)))
        if not spans:
            continue
        means = [float(one.departure_c[a:b].mean()) for a, b in spans]
        at = int(np.argmin(np.abs(np.array(means) - reference_c)))
        variances = squares @ unit_variances(len(one.values), cell_s)
        for k, span in enumerate(spans):
            contrast = _mean_of(len(one.values), span) - _mean_of(len(one.values), spans[at])
            sd = sqrt(float(cosines(contrast) ** 2 @ variances))
            below = None if k == 0 else means[k] > means[k - 1]
            slope, slope_sd, order = _within(one, span, squares, cell_s)
            level = float(contrast @ one.values)
            found.append(SoakFit(index, means[k], below, level, sd, slope, slope_sd, order))
    if not found:
        raise UnfitRecording(
            f"the temperature never stood still for least_soak_s, {least_s:g} s: there is no soak to fit. Ways out: "
            "soaks = false fits a temperature that moves all the time, without comparing soaks; a shorter "
            "least_soak_s; other limits of a still temperature (regime)"
        )
    return tuple(found)


def _static(one: Series, least: int) -> list[tuple[int, int]]:
    if one.dynamic is None:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[1], one.dynamic.astype(np.int8), [1]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= least]


def _mean_of(count: int, span: tuple[int, int]) -> Array:
    weights = np.zeros(count)
    weights[span[0] : span[1]] = 1.0 / (span[1] - span[0])
    return weights


def _within(
    one: Series, span: tuple[int, int], squares: Array, cell_s: float
) -> tuple[float | None, float | None, int | None]:
    """Slope with its standard uncertainty, and the preferred order, within a soak."""
    values, departure = one.values[slice(*span)], one.departure_c[slice(*span)]
    if float(np.ptp(departure)) < MOVED_C or len(values) < 3 * (LARGEST_ORDER + 1):
        return None, None, None
    centred = (departure - departure.mean()) / max(float(np.ptp(departure)), 1e-9)
    variances = squares @ unit_variances(len(values), cell_s)
    variances = np.concatenate([variances[:1], variances])
    columns = whiten(centred[:, None] ** np.arange(LARGEST_ORDER + 1), variances)
    kept = whiten(values, variances)
    inverse = np.linalg.pinv(columns[:, :2])
    size = float(np.ptp(departure))
    orders = compare_orders(columns, [list(range(q + 1)) for q in range(1, LARGEST_ORDER + 1)], kept, *[len(kept)] * 2)
    return float(inverse[1] @ kept) / size, sqrt(float(inverse[1] @ inverse[1])) / size, orders.preferred


def repeatability(fits: Sequence[SoakFit], within_c: float) -> tuple[Repeatability, ...]:
    """Levels of soaks of like temperature, `within_c` of each other, over all recordings and visits.

    The reference soak of a recording, whose level is zero by definition, does not count.
    """
    rest = sorted((f for f in fits if f.level_sd > 0.0), key=lambda f: f.temperature_c)
    groups: list[list[SoakFit]] = []
    for one in rest:
        if groups and one.temperature_c - groups[-1][0].temperature_c <= within_c:
            groups[-1].append(one)
        else:
            groups.append([one])
    return tuple(_repeated(group) for group in groups if len(group) > 1)


def _repeated(group: Sequence[SoakFit]) -> Repeatability:
    levels, sd = np.array([f.level for f in group]), np.array([f.level_sd for f in group])
    weights = sd**-2.0
    statistic = float(np.sum(weights * (levels - np.average(levels, weights=weights)) ** 2))
    gap, gap_sd = None, None
    up, down = (np.array([f.from_below is way for f in group]) for way in (True, False))
    if up.any() and down.any():
        gap = float(levels[up].mean() - levels[down].mean())
        gap_sd = float(np.sqrt(np.sum(sd[up] ** 2) / up.sum() ** 2 + np.sum(sd[down] ** 2) / down.sum() ** 2))
    return Repeatability(
        float(np.mean([f.temperature_c for f in group])),
        len(group),
        float(np.std(levels, ddof=1)),
        float(np.sqrt(np.mean(sd**2))),
        float(chdtrc(len(group) - 1, statistic)),
        gap,
        gap_sd,
    )
