"""Slow noise that could be another process as well: intervals of B and K that hold whichever it is.

One record does not tell a flicker, a rate random walk and a Gauss–Markov process apart where it shows only a little of
them. The test that finds one of them compares it with nothing, not with the others.
"""

from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np

from procedures.analysis.noise_fit.columns import BIAS_INSTABILITY, RATE_RANDOM_WALK
from procedures.analysis.noise_fit.estimate import Estimate
from procedures.analysis.noise_fit.extensions import Extension, candidates
from procedures.analysis.noise_fit.joined import Joined
from procedures.analysis.noise_fit.restricted import Profile, Spectrum, State, information, maximum
from procedures.analysis.noise_fit.selection import Selection, inverse_information

DOUBT = 4.0
"""Twice the log likelihood that another process gains, from which on intervals allow for it."""
SLOW = (BIAS_INSTABILITY, RATE_RANDOM_WALK)
_EVERY = 3


@dataclass(frozen=True)
class _Fit:
    """One other model: all processes allowed, and its own."""

    model: Extension
    spectrum: Spectrum
    best: State

    @property
    def everything(self) -> tuple[int, ...]:
        """All columns."""
        return tuple(range(self.spectrum.columns.shape[1]))

    def without(self, k: int) -> float:
        """The log likelihood with the process k left out."""
        free = [i for i in self.everything if i != k]
        return maximum(self.spectrum, free, start=self.best.variances).log_likelihood


@dataclass(frozen=True)
class Doubt:
    """What else the slow noise may be."""

    estimates: dict[int, Estimate]
    """By process, with intervals that allow for it."""
    model: Extension | None
    """The likeliest other model; None: there is no doubt."""


def allowed_for(
    joined: Joined,
    plain: Joined,
    selection: Selection,
    own: State,
    estimates: dict[int, Estimate],
    losses: tuple[float, float],
) -> Doubt:
    """Widens the intervals of B and K that are present; `own` is the fit of all processes with the selection's ramp.

    `plain` are the bins without what extends the model. `losses` are those of an interval's and of an upper limit's
    end. A process whose absence costs no more than an interval's end once another is allowed has an interval from
    zero; the limit of one that was not observed is raised where the other model is as likely.
    """
    extended = joined is not plain
    if not extended and not any(k in selection.present for k in SLOW):
        return Doubt({}, None)
    fits = _fits(plain, selection, own)
    if not fits:
        return Doubt({}, None)
    top = max(own.log_likelihood, *(f.best.log_likelihood for f in fits))
    likely = fits[0]
    doubtful = extended or 2.0 * (top - own.log_likelihood) >= DOUBT
    changed: dict[int, Estimate] = {}
    for k in SLOW:
        missing = [f for f in fits if k in selection.present and 2.0 * (top - f.without(k)) <= losses[0]]
        if missing or doubtful:
            others = {id(f): f for f in (*missing[:1], *(fits if doubtful else []))}
            changed[k] = _wider(estimates[k], k, list(others.values()), top, losses, zero=bool(missing))
    changed = {k: e for k, e in changed.items() if e != estimates[k]}
    return Doubt(changed, likely.model if changed else None)


def _fits(plain: Joined, selection: Selection, own: State) -> list[_Fit]:
    """The likeliest two models of each kind, the likeliest first."""
    found: list[_Fit] = []
    for model in candidates(plain, _EVERY):
        spectrum = model.applied(plain).used
        spectrum = spectrum if selection.ramp else spectrum.without_ramp
        columns = spectrum.columns.shape[1]
        begin = np.zeros(columns)
        known = min(plain.spectrum.columns.shape[1], columns)
        begin[:known] = own.variances[:known]
        if model.time_s is not None:  # nothing grows from zero by itself
            begin[-1] = 0.5 * float(np.min(own.power / spectrum.columns[:, -1]))
        found.append(_Fit(model, spectrum, maximum(spectrum, range(columns), start=begin)))
    found.sort(key=lambda f: -f.best.log_likelihood)
    times = [f for f in found if f.model.time_s is not None]
    corners = [f for f in found if f.model.time_s is None]
    return sorted((*times[:2], *corners[:2]), key=lambda f: -f.best.log_likelihood)


def _wider(
    estimate: Estimate, k: int, fits: list[_Fit], top: float, losses: tuple[float, float], *, zero: bool
) -> Estimate:
    """The interval and the limit over all models."""
    present = estimate.value is not None
    ends = [estimate.lower or 0.0], [estimate.upper or 0.0], [estimate.upper_limit]
    for fit in fits:
        variance = inverse_information(information(fit.spectrum, fit.best))[k, k]
        profile = Profile(fit.spectrum, fit.everything, k, fit.best)
        lost = 2.0 * (top - fit.best.log_likelihood)
        for into, loss in ((ends[1], losses[0]), (ends[2], losses[1])):
            if loss > lost:
                found = profile.crossing(loss - lost, upwards=True, scale=sqrt(variance))
                into.append(sqrt(found) if found < inf else 0.0)
        if present and not zero and losses[0] > lost:
            ends[0].append(sqrt(profile.crossing(losses[0] - lost, upwards=False, scale=sqrt(variance))))
    if not present:
        return replace(estimate, upper_limit=max(ends[2]))
    return replace(estimate, lower=0.0 if zero else min(ends[0]), upper=max(ends[1]), upper_limit=max(ends[2]))
