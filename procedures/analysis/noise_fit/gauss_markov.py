"""Estimate of a detected Gauss–Markov process: correlation time and driving noise with their uncertainties."""

from math import log, sqrt

import numpy as np

from procedures.analysis.noise_fit.estimate import GaussMarkov
from procedures.analysis.noise_fit.extensions import Extension
from procedures.analysis.noise_fit.joined import Joined
from procedures.analysis.noise_fit.restricted import State, information, maximum
from procedures.analysis.noise_fit.selection import inverse_information

_RATIO = 2.0**0.5


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


def _at(plain: Joined, time_s: float, free: tuple[int, ...]) -> tuple[State, float]:
    """Fit with a given correlation time, and the relative uncertainty of its variance."""
    spectrum = Extension(time_s=time_s).applied(plain).used
    used = [k for k in free if k < spectrum.columns.shape[1] - 1]
    used.append(spectrum.columns.shape[1] - 1)
    state = maximum(spectrum, used)
    covariance = inverse_information(information(spectrum, state)[np.ix_(used, used)])
    variance = float(state.variances[-1])
    return state, sqrt(float(covariance[-1, -1])) / variance if variance > 0.0 else 0.0
