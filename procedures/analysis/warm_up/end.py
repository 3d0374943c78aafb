"""The end of the warm-up: the transient's last moment above a stated share of the noise.

Thesis 4.1.2 finds a transient of 600 s in a moving average; paper A fits a sum of exponentials and cuts 11 700 s; the
standards require the warm-up to be cut off, without defining its end. Here it ends where the fitted curve falls below
`FRACTION` of the noise's own Allan deviation at the averaging time, and stays there.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from procedures.analysis.averaging_time import allan_variance
from procedures.analysis.coloured_noise import CosineSeries, cosine_series
from procedures.analysis.warm_up.fit import (
    SHORTEST,
    Family,
    Fit,
    candidates,
    curve,
    exponentials,
    no_transient,
    pair,
    refine,
)
from procedures.analysis.warm_up.shapes import Shape, ended_exponential, exponential, raised_cosine, straight
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.noise import NoiseCoefficients

FRACTION = 0.1
SIGNIFICANCE = 1e-3
"""Asymptotic, and several times too small where flicker is only just visible in the record: see the validation."""
_NAMES: dict[Shape, str] = {
    raised_cosine: "raised cosine",
    straight: "straight",
    ended_exponential: "ended exponential",
}
_BENDS: dict[Shape, float] = {exponential: 4.0, raised_cosine: 0.0, straight: 0.0}
"""Starting value of an ended exponential's length, in time constants, by the curve it starts from."""
_CLEARLY = 2.0
"""Twice the log likelihood by which a curve that ends must exceed exponentials, which never end."""


@dataclass(frozen=True)
class WarmUp:
    """A detected warm-up transient. Times are since power-up."""

    shape: str
    """"one exponential", "two exponentials", "raised cosine", "straight" or "ended exponential"."""
    amplitude: float
    """Amplitude at the record's beginning [rate]."""
    amplitude_sd: float
    end_s: float
    """Time after which it stays below `level`; later than the record where `has_ended` is false."""
    end_sd_s: float
    """Standard uncertainty propagated from the fitted curve; the shape and the level count as exact."""
    has_ended: bool
    """True if it ends within the record."""
    first_cell: int
    """The first cell that begins after the end; the number of cells where `has_ended` is false."""
    level: float
    """Level that defines the end [rate]."""
    p_value: float
    """Probability that noise alone resembles a transient as much."""
    noise: NoiseCoefficients
    """Noise of the record without the transient."""
    start_s: float
    fit: Fit

    def curve(self, t_s: Array) -> Array:
        """Return the transient at times since power-up, none before the record, shape of `t_s` [rate]."""
        return self.fit.at(np.asarray(t_s, dtype=np.float64) - self.start_s)


def find_warm_up(
    cells: Array,
    cell_s: float,
    start_s: float = 0.0,
    *,
    averaging_s: float = 70.0,
    fraction: float = FRACTION,
    significance: float = SIGNIFICANCE,
) -> WarmUp | None:
    """The transient at the beginning of a record, or None where noise explains it.

    Parameters
    ----------
    cells : (n,) means of the rate [rate] over cells of `cell_s` [s], the first beginning `start_s` [s] after power-up.
    averaging_s, fraction : the end's level is `fraction` of the fitted noise's Allan deviation at `averaging_s`:
        ``fraction·√(3Q²/τ² + N²/τ + (2 ln 2/π)B² + K²τ/3)``.
    significance : a transient is found where the likelihood ratio's p-value is below (`warm_up.fit`).

    Raises `BadParameter` and `UnfitRecording`. Series of more than 2048 cells are averaged to no more than that;
    transients with time constants below two of those cells, or above half the record, are not sought.
    """
    if not 0.0 <= start_s < np.inf:
        raise BadParameter("start_s", start_s, "finite and not negative")
    for name, value, most in (
        ("averaging_s", averaging_s, np.inf),
        ("fraction", fraction, np.inf),
        ("significance", significance, 1.0),
    ):
        if not 0.0 < value < most:
            raise BadParameter(name, value, f"above 0 and below {most:g}")
    series = cosine_series(cells, cell_s)
    fit = _transient(series, significance)
    if not fit.shapes:
        return None
    noise = fit.noise.noise
    level = fraction * sqrt(allan_variance(noise, averaging_s))
    end, end_sd = _end(fit, level, len(cells) * cell_s)
    has_ended = end < len(cells) * cell_s
    variances = fit.covariance[:: len(fit.covariance) // len(fit.shapes), :: len(fit.covariance) // len(fit.shapes)]
    return WarmUp(
        shape=_NAMES.get(fit.shapes[0], "one exponential" if len(fit.shapes) == 1 else "two exponentials"),
        amplitude=float(np.sum(fit.amplitudes)),
        amplitude_sd=sqrt(float(np.sum(variances))),
        end_s=start_s + end,
        end_sd_s=end_sd,
        has_ended=has_ended,
        first_cell=min(int(np.ceil(end / cell_s - 1e-9)), len(cells)) if has_ended else len(cells),
        level=level,
        p_value=fit.p_value,
        noise=noise,
        start_s=start_s,
        fit=fit,
    )


def _transient(series: CosineSeries, significance: float) -> Fit:
    """The likeliest curve by Akaike's criterion, or none where no transient is significant."""
    none = no_transient(series)
    stopping = (Family.over(series, shape, 2.0 * SHORTEST, 1.0) for shape in (raised_cosine, straight))
    families = (exponentials(series), *stopping)
    ones = candidates(series, none, families, significance)
    if not ones:
        return pair(series, none, families[0], significance) or none
    found = list(ones)
    for one in ones:
        if one.shapes[0] is exponential:
            found += candidates(series, one, families[:1], significance)
    found += _ended(series, ones)
    length = float(series.edges_s[-1])
    stays = [f for f in found if f.shapes[0] is exponential or np.exp(f.own[0][0]) < length]
    return replace(min(stays or found, key=_criterion), p_value=min(one.p_value for one in ones))


def _criterion(fit: Fit) -> float:
    """``−2 ln L + 2p``; a curve that ends must be clearly likelier than an exponential, which never ends."""
    return fit.noise.deviance + 2.0 * len(fit.parameters) + (0.0 if fit.shapes[0] is exponential else _CLEARLY)


def _ended(series: CosineSeries, ones: Sequence[Fit]) -> list[Fit]:
    """Fits of the ended exponential, started from the two likeliest curves of one time."""
    found: list[Fit] = []
    for one in ones[:2]:
        bend = _BENDS[one.shapes[0]]
        start = np.array([one.amplitudes[0], one.own[0][0] + (np.log(bend) if bend else 0.0), bend])
        start[1] = min(start[1], np.log(0.9 * series.edges_s[-1]))
        ended = refine(series, one.noise, (ended_exponential,), start)
        found += [] if ended is None else [ended]
    return found


def _end(fit: Fit, level: float, length: float) -> tuple[float, float]:
    """Time of the last crossing of the level [s] from the first cell's beginning, and its standard uncertainty [s].

    ``u² = gᵀCg`` with ``g = −(∂s/∂θ)/(∂s/∂t)``, the curve's s at the crossing. Sought up to ten records' lengths.
    """
    x = np.concatenate([[0.0], np.geomspace(1e-5 * length, 10.0 * length, 2000)])
    above = np.flatnonzero(np.abs(fit.at(x)) > level)
    if len(above) == 0:
        return 0.0, 0.0
    low, high = float(x[above[-1]]), float(x[min(above[-1] + 1, len(x) - 1)])
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if abs(float(fit.at(np.array([middle]))[0])) > level else (low, middle)
    at, parameters, step = np.array([low]), fit.parameters, 1e-5
    slope = float((fit.at(at * (1.0 + step)) - fit.at(at * (1.0 - step)))[0]) / (2.0 * step * low)
    here, sizes = float(fit.at(at)[0]), step * np.sqrt(np.diagonal(fit.covariance))
    moved = [curve(fit.shapes, parameters + e, at)[0] - here for e in np.diag(sizes)]
    gradient = -np.array(moved) / sizes / slope
    return low, float(np.sqrt(gradient @ fit.covariance @ gradient))
