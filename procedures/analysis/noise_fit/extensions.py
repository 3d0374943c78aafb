"""Slow noise that the five coefficients do not describe: a Gauss–Markov process, or a flicker with another corner.

A Gauss–Markov process of correlation time τ and driving noise q has the two-sided density ``q²τ²/(1 + (2πfτ)²)``,
variance σ² = q²τ/2 (IEEE Std 952 Annex C). Means over cells of Δ, a = e^(−Δ/τ), have the covariance
``γ(0) = 2σ²(τ/Δ)²(Δ/τ − 1 + a)``, ``γ(l) = σ²(τ/Δ)²(1 − a)²a^(l−1)``, hence in a mode of phase step ω the power
``γ(0) + 2σ²(τ/Δ)²(1 − a)²(cos ω − a)/(1 − 2a cos ω + a²)``.

The flicker of `core.noise` is a bank of such processes, evenly in ln τ, B²/π of variance each e-fold: a longer shortest
time removes the fastest of them. The extension that a record needs is sought by score tests first (C. R. Rao, Proc.
Camb. Phil. Soc. 44 (1948) 50), which cost one fit; then by likelihood ratios.
"""

from dataclasses import dataclass, replace
from math import exp, log, pi, sqrt

import numpy as np

from procedures.analysis.noise_fit.columns import BIAS_INSTABILITY, RANDOM_WALK, RATE_RANDOM_WALK
from procedures.analysis.noise_fit.joined import Joined
from procedures.analysis.noise_fit.powers import FLICKER_BAND_S
from procedures.analysis.noise_fit.restricted import State, information, maximum
from procedures.core.arrays import Array

SHORTEST_S, CELLS = 2.0, 2.0
"""Least correlation time, in seconds and in cells; a shorter one is the edge of a filter."""
SHORT_CORNERS_S = (0.05, 0.1, 0.2, 1.0)
"""Shortest relaxation times of a flicker that are tried in addition to the times of a Gauss–Markov process."""
_CORNER_OF_LONGEST = 0.3
LONGEST = 0.1
"""Greatest correlation time as a share of the record; a longer one looks like a random walk."""
SCORE = 2.7
"""Score, in standard deviations, from which on the extension is fitted."""
GAIN_OF_TIME, GAIN_OF_CORNER = 16.0, 11.0
"""Required gain in twice the log likelihood: χ² of two and of one degree at 5e-4, for several times tried."""
_RATIO = 2.0**0.5
"""Ratio of two successive trial times."""
_ALIASES = 8
"""Aliases on either side that count in the power of sampled means."""
_NO_CORNER, _LEAST_CORNER, _LEAST_TIME = 1e-4, 0.06, 2.0
"""Shortest corner and correlation time that are tried, in samples: a shorter corner looks like none at all."""
_NEARBY = 1.4
"""Standard uncertainties of ln τ at which a second process is considered: they cost half of what an interval may."""
_FINEST = 0.05
"""Step of ln τ that ends the search for the correlation time of a fast process."""
_PER_E_FOLD = 4
_EVERY = 2
"""The first search tries every n-th time."""
_FIRST_CORNER_S = FLICKER_BAND_S[0]


@dataclass(frozen=True)
class Extension:
    """One extension of the model: an additional Gauss–Markov process, or a flicker of another shortest time."""

    time_s: float | None = None
    """Correlation time of the process."""
    corner_s: float | None = None
    """Shortest relaxation time of the flicker; 0: samples of a flicker that ends at half of the sampling rate."""

    spread: float = 0.0
    """Standard uncertainty of ln τ, where it is known."""

    def applied(self, joined: Joined) -> Joined:
        """Return the bins with this model's columns; the process is the last of them."""
        s = joined.spectrum
        columns = s.columns.copy()
        if self.corner_s is not None:
            columns[:, BIAS_INSTABILITY] = flicker_from(joined, self.corner_s)
        if self.time_s is None:
            return replace(joined, spectrum=replace(s, columns=columns))
        columns = np.column_stack([columns, gauss_markov(joined, self.time_s)])
        return replace(joined, spectrum=replace(s, columns=columns), added=1)

    def scaled(self, factor: float) -> "Extension":
        """Return the same extension with its time multiplied by `factor`."""
        if self.time_s is not None:
            return Extension(time_s=factor * self.time_s)
        return Extension(corner_s=factor * (self.corner_s or 0.0))

    def taken_from(self, joined: Joined) -> Joined:
        """Return the bins with their columns as before the extension."""
        s = joined.spectrum
        columns = s.columns[:, : s.columns.shape[1] - joined.added].copy()
        columns[:, BIAS_INSTABILITY] = joined.flicker
        return replace(joined, spectrum=replace(s, columns=columns), added=0)


def gauss_markov(joined: Joined, time_s: float) -> Array:
    """Expected power (b,) of a Gauss–Markov process of unit variance.

    A process whose correlation time reaches a segment's length leaks like a random walk; the leakage is taken from the
    exact column of the latter.
    """
    period, omega = joined.period_s, 2.0 * pi * joined.frequency_hz * joined.period_s
    ratio, cosine = time_s / period, np.cos(omega)
    a = np.exp(-1.0 / ratio)
    size = ratio**2
    power = 2.0 * size * (1.0 / ratio - 1.0 + a) + 2.0 * size * (1.0 - a) ** 2 * (cosine - a) / (
        1.0 - 2.0 * a * cosine + a**2
    )
    walk = period / (2.0 - 2.0 * cosine) - period / 6.0
    fast = joined.frequency_hz[joined.is_fast]
    lasting = (2.0 * pi * float(np.min(np.diff(fast))) * time_s) ** 2 if len(fast) > 1 else 0.0
    steep = np.where(joined.is_fast, lasting, 0.0)
    return power * (joined.spectrum.columns[:, RATE_RANDOM_WALK] / walk) ** (steep / (1.0 + steep))


def flicker_from(joined: Joined, corner_s: float) -> Array:
    """Return the expected power (b,) of a flicker of unit B² with the shortest relaxation time `corner_s`.

    With 0 the samples are those of a flicker without any power above half of the sampling rate: neither means over a
    sample's time nor aliases.
    """
    if corner_s == 0.0:
        means = flicker_from(joined, _NO_CORNER * float(np.min(joined.period_s)))
        return np.where(joined.is_fast, means / _of_means(joined.frequency_hz * joined.period_s), means)
    count = max(2, round(_PER_E_FOLD * abs(log(corner_s / _FIRST_CORNER_S))) + 1)
    times = np.geomspace(_FIRST_CORNER_S, corner_s, count)
    weights = np.full(count, log(corner_s / _FIRST_CORNER_S) / (count - 1))
    weights[[0, -1]] *= 0.5
    taken = sum(w * gauss_markov(joined, float(t)) for w, t in zip(weights, times, strict=True))
    column = joined.spectrum.columns[:, BIAS_INSTABILITY]
    return np.maximum(column - taken / pi, 1e-6 * column)


def _of_means(cycles: Array) -> Array:
    """Power of a flicker's means over a sample's time, aliases included, over that of the flicker; (b,) of cycles a
    sample.
    """
    folded = cycles[:, None] + np.arange(-_ALIASES, _ALIASES + 1)
    return np.sum(np.sinc(folded) ** 2 * cycles[:, None] / np.abs(folded), axis=1)


def extension(joined: Joined, at: State) -> Extension | None:
    """Return the extension that the record needs, or None; `at` is the fit of all five processes, with a ramp."""
    best, most = None, 0.0
    for one in candidates(joined, _EVERY):
        if _score(joined, at, one) > SCORE:
            gain = _gain(joined, at, one)
            if gain > most:
                best, most = one, gain
    if best is None:
        return None
    for factor in (1.0 / _RATIO, _RATIO):
        other = best.scaled(factor)
        gain = _gain(joined, at, other)
        if gain > most:
            best, most = other, gain
    return best if most > (GAIN_OF_CORNER if best.time_s is None else GAIN_OF_TIME) else None


def fast_extension(joined: Joined, plain: State) -> tuple[Extension, State] | None:
    """Return the likeliest extension that acts at the full rate, with its fit, or None where none is likelier.

    A flicker that goes on above the frequencies of `core.noise` up to half of the sampling rate, or a Gauss–Markov
    process faster than those of `candidates`. `plain` is the fit of all five processes. White noise behind a low-pass
    filter is no such process: without white noise above it, a Gauss–Markov process is not considered.
    """
    if not np.any(joined.is_fast):
        return None
    tried: dict[Extension, State] = {}

    def gain_of(one: Extension) -> float:
        if one not in tried:
            extended = one.applied(joined).used
            tried[one] = maximum(extended, range(extended.columns.shape[1]))
        return 2.0 * (tried[one].log_likelihood - plain.log_likelihood)

    best = max(_fast_candidates(joined), key=gain_of)
    step = log(_RATIO)
    while best.corner_s != 0.0:
        other = max((best.scaled(exp(sign * step)) for sign in (-1.0, 1.0)), key=gain_of)
        if gain_of(other) > gain_of(best):
            best = other
        elif best.time_s is None or step < _FINEST:
            break
        else:
            step /= 3.0
    gain, state = gain_of(best), tried[best]
    if best.time_s is None:
        return (best, state) if gain > GAIN_OF_CORNER else None
    if gain < GAIN_OF_TIME or not _has_white(best.applied(joined), state):
        return None
    bend = (gain_of(best.scaled(exp(-step))) - 2.0 * gain + gain_of(best.scaled(exp(step)))) / step**2
    return replace(best, spread=sqrt(-2.0 / bend) if bend < 0.0 else 0.0), state


def _fast_candidates(joined: Joined) -> list[Extension]:
    """Corners from the shortest of `candidates` down to a part of a sample, and correlation times up to theirs."""
    period = float(np.min(joined.period_s))
    corners = _between(_LEAST_CORNER * period, SHORT_CORNERS_S[0])
    times = _between(_LEAST_TIME * period, SHORTEST_S)
    return [*(Extension(corner_s=t) for t in (*corners, 0.0)), *(Extension(time_s=t) for t in times)]


def _between(shortest: float, longest: float, ratio: float = 2.0) -> list[float]:
    """Times from `longest` down to `shortest`, each in a ratio to the one before."""
    return [longest * ratio**-k for k in range(int(log(max(longest / shortest, 1.0)) / log(ratio)) + 1)]


def _has_white(joined: Joined, state: State) -> bool:
    """Return whether the fit needs white noise in addition to a fast Gauss–Markov process."""
    others = [k for k in range(joined.spectrum.columns.shape[1]) if k != RANDOM_WALK]
    without = maximum(joined.used, others, start=state.variances)
    return 2.0 * (state.log_likelihood - without.log_likelihood) > GAIN_OF_TIME


def nearby(model: Extension | None, joined: Joined) -> list[Extension]:
    """Return models that the record may have instead of the one that was found.

    Of a fast process: times within its uncertainty. Of a flicker with a short corner: all short corners. Otherwise a
    flicker that goes on, where the highest bins are not fitted.
    """
    if model is not None and model.time_s is not None and model.spread > 0.0:
        return [model.scaled(exp(sign * _NEARBY * model.spread)) for sign in (-1.0, 0.0, 1.0)]
    if not np.any(joined.is_fast):
        return []
    if model is None or model.corner_s is None or model.corner_s >= SHORT_CORNERS_S[0]:
        # a band that ends early may end where a flicker goes on
        return [] if np.all(joined.fitted) else [Extension(corner_s=0.25 * SHORT_CORNERS_S[0]), Extension(corner_s=0.0)]
    longest = 2.0 * model.corner_s or SHORT_CORNERS_S[0]
    corners = _between(_LEAST_CORNER * float(np.min(joined.period_s)), min(longest, SHORT_CORNERS_S[0]), _RATIO)
    return [Extension(corner_s=t) for t in (*corners, 0.0)]


def candidates(joined: Joined, every: int = 1) -> list[Extension]:
    """Return the extensions to try; with `every` > 1, only each `every`-th of the trial times."""
    shortest = max(SHORTEST_S, CELLS * float(np.max(joined.period_s)))
    longest = LONGEST * 0.5 / float(joined.frequency_hz[0])
    if longest <= shortest:
        return []
    times = shortest * _RATIO ** np.arange(int(log(longest / shortest) / log(_RATIO)) + 1)
    some = times.tolist()[::every]
    corners = [*SHORT_CORNERS_S, *(t for t in some if t <= _CORNER_OF_LONGEST * longest)]
    return [*(Extension(time_s=t) for t in some), *(Extension(corner_s=t) for t in corners)]


def _score(joined: Joined, at: State, one: Extension) -> float:
    """Score of the extension's power over its standard deviation, corrected for the fitted variances."""
    used = joined.fitted
    if one.time_s is not None:
        column = gauss_markov(joined, one.time_s)[used]
    elif at.variances[BIAS_INSTABILITY] == 0.0:
        return 0.0
    else:
        own = joined.spectrum.columns[:, BIAS_INSTABILITY]
        column = (flicker_from(joined, one.corner_s or 0.0) - own)[used]
    free = np.flatnonzero(at.variances > 0.0)
    scaled = column / at.power
    others = joined.used.columns[:, free] / at.power[:, None]
    known = information(joined.used, at)[np.ix_(free, free)]
    shared = 0.5 * (others.T * at.dof) @ scaled
    size = np.sqrt(np.diag(known))
    explained = float(shared / size @ np.linalg.pinv(known / np.outer(size, size)) @ (shared / size))
    spread = 0.5 * float(np.dot(at.dof, scaled**2)) - explained
    score = 0.5 * float(np.dot(at.dof * scaled, at.residual / at.power - 1.0))
    return score / np.sqrt(spread) if spread > 1e-9 * float(np.dot(at.dof, scaled**2)) else 0.0


def _gain(joined: Joined, at: State, one: Extension) -> float:
    """Twice the gain in log likelihood by the extension."""
    extended = one.applied(joined).used
    return 2.0 * (maximum(extended, range(extended.columns.shape[1])).log_likelihood - at.log_likelihood)
