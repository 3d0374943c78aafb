"""Confidence intervals of B and K that hold whichever process causes the slow noise.

One record does not distinguish a flicker, a rate random walk and a Gauss–Markov process where they contribute little to
it. The test that detects one of them compares it with its absence, not with the other processes.
"""

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from procedures.analysis.noise_fit.columns import BIAS_INSTABILITY, RANDOM_WALK, RATE_RANDOM_WALK
from procedures.analysis.noise_fit.estimate import Estimate
from procedures.analysis.noise_fit.extensions import Extension, candidates, nearby
from procedures.analysis.noise_fit.joined import Joined
from procedures.analysis.noise_fit.restricted import Spectrum, State, information, maximum
from procedures.analysis.noise_fit.selection import Selection, inverse_information

DOUBT = 4.0
"""Twice the gain in log likelihood by another process from which on the intervals allow for it."""
STRONG_DOUBT = 6.0
"""The same gain from which on the doubt becomes a warning."""
SLOW = (BIAS_INSTABILITY, RATE_RANDOM_WALK)
_EVERY = 3


@dataclass(frozen=True)
class _Fit:
    """The fit of one alternative model, with all five processes and the one it adds."""

    model: Extension
    spectrum: Spectrum
    best: State

    @property
    def everything(self) -> tuple[int, ...]:
        """The indices of all columns."""
        return tuple(range(self.spectrum.columns.shape[1]))

    def without(self, k: int) -> float:
        """The log likelihood with the process k left out."""
        free = [i for i in self.everything if i != k]
        return maximum(self.spectrum, free, start=self.best.variances).log_likelihood


@dataclass(frozen=True)
class Doubt:
    """Alternative explanation of the slow noise, and the estimates with the intervals that it widens."""

    estimates: dict[int, Estimate]
    """Estimates by process, with intervals that allow for the alternative."""
    model: Extension | None
    """The likeliest alternative model; None where there is no doubt."""
    strong: bool = False
    """The reader must be warned: only the alternative makes the flicker uncertain, or it is clearly likelier."""


def allowed_for(
    joined: Joined,
    plain: Joined,
    selection: Selection,
    own: State,
    estimates: dict[int, Estimate],
    losses: tuple[float, float],
    model: Extension | None = None,
) -> Doubt:
    """Widen the intervals of N, B and K that are present; `own` is the fit of all processes with the selection's ramp.

    `plain`: the bins without the columns that extend the model. `losses`: twice the loss of log likelihood at the end
    of an interval and at an upper limit. A process whose absence costs no more than an interval's end once another
    process is allowed gets an interval from zero; the limit of an unobserved process is raised where the alternative
    model is as likely. `model`: the extension of `joined`.
    """
    extended = joined is not plain
    if not extended and not any(k in selection.present for k in SLOW):
        return Doubt({}, None)
    fits = _fits(plain, selection, own, nearby(model, plain))
    if not fits:
        return Doubt({}, None)
    top = max(own.log_likelihood, *(f.best.log_likelihood for f in fits))
    missing = {k for k in SLOW if k in selection.present and _can_miss(k, fits, top, losses[0])}
    doubtful = extended or bool(missing) or 2.0 * (top - own.log_likelihood) >= DOUBT
    changed: dict[int, Estimate] = {}
    for k in SLOW:
        # the corner of a flicker is part of its level; another process is considered only in case of doubt
        others = fits if doubtful else [f for f in fits if f.model.corner_s is not None and k == BIAS_INSTABILITY]
        changed[k] = _wider(estimates[k], k, others, top, losses, zero=k in missing)
    fast = model is not None and model.spread > 0.0
    if RANDOM_WALK in selection.present and (fast or BIAS_INSTABILITY in selection.present):
        # what another model leaves of a flicker, or of a fast process, is white noise to a fit
        others = [f for f in fits if (f.model.time_s is not None) == fast]
        changed[RANDOM_WALK] = _wider(estimates[RANDOM_WALK], RANDOM_WALK, others, top, losses, zero=False)
    sure = (estimates[BIAS_INSTABILITY].lower or 0.0) > 0.0
    strong = (sure and BIAS_INSTABILITY in missing) or 2.0 * (top - own.log_likelihood) >= STRONG_DOUBT
    return Doubt(changed, fits[0].model if doubtful else None, strong)


def _can_miss(k: int, fits: list[_Fit], top: float, loss: float) -> bool:
    """True if some alternative model explains the record without process k, within the loss of an interval's end."""
    return any(2.0 * (top - f.best.log_likelihood) <= loss and 2.0 * (top - f.without(k)) <= loss for f in fits)


def _fits(plain: Joined, selection: Selection, own: State, also: list[Extension]) -> list[_Fit]:
    """Fit the alternative models, and `also` some more; return the likeliest of each kind, the likeliest first."""
    found: list[_Fit] = []
    for model in (*candidates(plain, _EVERY), *also):
        spectrum = model.applied(plain).used
        spectrum = spectrum if selection.ramp else spectrum.without_ramp
        columns = spectrum.columns.shape[1]
        begin = np.zeros(columns)
        known = min(plain.spectrum.columns.shape[1], columns)
        begin[:known] = own.variances[:known]
        if model.time_s is not None:  # a variance that starts at zero stays there
            begin[-1] = 0.5 * float(np.min(own.power / spectrum.columns[:, -1]))
        found.append(_Fit(model, spectrum, maximum(spectrum, range(columns), start=begin)))
    found.sort(key=lambda f: -f.best.log_likelihood)
    times = [f for f in found if f.model.time_s is not None]
    corners = [f for f in found if f.model.time_s is None]
    most = max(2, len(also))
    return sorted((*times[:most], *corners[:most]), key=lambda f: -f.best.log_likelihood)


def _wider(
    estimate: Estimate, k: int, fits: list[_Fit], top: float, losses: tuple[float, float], *, zero: bool
) -> Estimate:
    """Extend interval and limit over all models, by the Fisher information of each: ``v ± √(loss left)·sd``."""
    present = estimate.value is not None
    ends = [estimate.lower or 0.0], [estimate.upper or 0.0], [estimate.upper_limit]
    for fit in fits:
        lost = 2.0 * (top - fit.best.log_likelihood)
        free = [i for i in fit.everything if fit.best.variances[i] > 0.0 or i == k]
        known = inverse_information(information(fit.spectrum, fit.best)[np.ix_(free, free)])
        v, sd = float(fit.best.variances[k]), sqrt(float(known[free.index(k), free.index(k)]))
        for into, loss, sign in zip(ends, (losses[0], *losses), (-1.0, 1.0, 1.0), strict=True):
            if loss > lost:
                into.append(sqrt(max(0.0, v + sign * sqrt(loss - lost) * sd)))
    if not present:
        return replace(estimate, upper_limit=max(ends[2]))
    return replace(estimate, lower=0.0 if zero else min(ends[0]), upper=max(ends[1]), upper_limit=max(ends[2]))
