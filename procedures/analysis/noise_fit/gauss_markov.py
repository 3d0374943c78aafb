"""Estimate of a detected Gauss–Markov process: correlation time and driving noise with their uncertainties."""

from math import log, sqrt

import numpy as np

from procedures.analysis.noise_fit.columns import RANDOM_WALK
from procedures.analysis.noise_fit.estimate import GaussMarkov
from procedures.analysis.noise_fit.extensions import Extension
from procedures.analysis.noise_fit.joined import Joined
from procedures.analysis.noise_fit.restricted import State, information, maximum
from procedures.analysis.noise_fit.selection import inverse_information

FILTER_S, FILTER_SAMPLES = 0.25, 8.5
"""Correlation time below which a low-pass filter of a unit may as well be the cause: 0.64 Hz, or 2 % of the rate."""
ONE_SIDED = 1.645
_RATIO = 2.0**0.5
_PAIR = [RANDOM_WALK, -1]


def gauss_markov(plain: Joined, model: Extension, free: tuple[int, ...]) -> GaussMarkov | None:
    """Fit a parabola in ln τ to the log likelihood at three times about the best; `free` are the fit's variances.

    ``ln τ ± 1/√(−d²L/d(ln τ)²)``; the driving noise q = √(2σ²/τ) has the uncertainty of σ² at one τ and that which
    comes with τ. None where the model has no such process.
    """
    if model.time_s is None:
        return None
    times = [model.time_s / _RATIO, model.time_s, model.time_s * _RATIO]
    found = [_at(plain, time_s, free) for time_s in times]
    low, middle, high = (state.log_likelihood for state, _ in found)
    step = log(_RATIO)
    bend = (low - 2.0 * middle + high) / step**2
    drivings = [sqrt(max(0.0, 2.0 * float(s.variances[-1]) / t)) for (s, _), t in zip(found, times, strict=True)]
    relative = found[1][1]
    if drivings[1] == 0.0:  # the octaves that are fitted do without it
        return None
    if bend >= 0.0:
        return GaussMarkov(model.time_s, None, drivings[1], None)
    moved = float(np.clip(-(high - low) / (2.0 * step) / bend, -step, step))
    slope = (drivings[2] - drivings[0]) / (2.0 * step)
    sd = 1.0 / sqrt(-bend)
    driving = drivings[1] + slope * moved
    time_s = model.time_s * float(np.exp(moved))
    return GaussMarkov(time_s, time_s * sd, driving, sqrt((0.5 * relative * driving) ** 2 + (slope * sd) ** 2))


def like_a_filter(found: GaussMarkov, period_s: float) -> bool:
    """Return whether a process is so fast that white noise behind a filter, then a reader's white noise, looks alike.

    `period_s`: sampling period of the record.
    """
    return found.time_s < max(FILTER_S, FILTER_SAMPLES * period_s)


def low_frequency_limit(joined: Joined, model: Extension, at: State) -> float:
    """Upper limit of the random walk below the corner of a fast process, ``√(N² + q²τ²)``: that of 95 %.

    `at` is the fit with the process in the last column. The sum of the two powers has an uncertainty of its own, to
    which the correlation time contributes: the process's part goes about as τ where its fast part is given.
    """
    known = inverse_information(information(joined.used, at)[np.ix_(_PAIR, _PAIR)])
    gains = np.array([1.0, 2.0 * (model.time_s or 0.0)])
    value = float(gains @ at.variances[_PAIR])
    by_time = float(gains[1] * at.variances[-1]) * model.spread
    return sqrt(value + ONE_SIDED * sqrt(float(gains @ known @ gains) + by_time**2))


def _at(plain: Joined, time_s: float, free: tuple[int, ...]) -> tuple[State, float]:
    """Fit with a given correlation time, and the relative uncertainty of its variance."""
    spectrum = Extension(time_s=time_s).applied(plain).used
    used = [k for k in free if k < spectrum.columns.shape[1] - 1]
    used.append(spectrum.columns.shape[1] - 1)
    state = maximum(spectrum, used)
    covariance = inverse_information(information(spectrum, state)[np.ix_(used, used)])
    variance = float(state.variances[-1])
    return state, sqrt(float(covariance[-1, -1])) / variance if variance > 0.0 else 0.0
