"""Noise coefficients by maximum likelihood of the spectrum (Whittle), with the processes selected and the fit judged.

P. Whittle, Ark. Mat. 2 (1953) 423: modes of a stationary record are asymptotically independent and normal, so their
powers hold all information of the record; the coefficients reach the Cramér-Rao bound. `powers` states what is exact
and what is approximate; `restricted` finds the maximum, `selection` decides which processes are present.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt

import numpy as np
from scipy.special import chdtri

from procedures.analysis.noise_fit.alternatives import Doubt, allowed_for
from procedures.analysis.noise_fit.bands import Agreement, agreed
from procedures.analysis.noise_fit.columns import RANDOM_WALK
from procedures.analysis.noise_fit.estimate import PROCESSES, Estimate, NoiseFit
from procedures.analysis.noise_fit.followed import Candidate, followed
from procedures.analysis.noise_fit.gauss_markov import gauss_markov, like_a_filter, low_frequency_limit
from procedures.analysis.noise_fit.lines import SpectralLine
from procedures.analysis.noise_fit.powers import Powers
from procedures.analysis.noise_fit.restricted import Profile, Spectrum, State, information, maximum
from procedures.analysis.noise_fit.selection import VARIANCES, Selection, inverse_information, select
from procedures.analysis.noise_fit.undescribed import NOTHING, Hidden, bounded, limited, undescribed
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter

METHOD = "likelihood"
_SAME_MODES = 3.0
"""Distance, in modes of a segment, below which a line seen in both parts is reported once."""
_TOLD = 0.25
"""Share of the cell frequency; lines above it belong to the fast part, or are aliases of it."""
CHOSEN_BAND = 1.4
"""Variance of an estimate from a band chosen by its own record, relative to that from a given band (Monte Carlo)."""
LIMIT = 0.95
"""Probability of an upper limit."""


def fit_noise(
    slow: Powers,
    fast: Powers | None = None,
    *,
    level: float = 0.01,
    confidence: float = 0.95,
    candidates: Sequence[Candidate] = (),
    hidden: Hidden = NOTHING,
) -> NoiseFit:
    """Estimate Q, N, B, K, R of one channel from its slow powers and, where given, its fast powers.

    `level`: the probability of reporting an absent process as present; `confidence`: that of the intervals; `hidden`:
    the processes that the steps of the samples hide.
    `candidates`: the conditions under which each further regressor of the slow powers is kept.
    The fast powers are used from their first frequency up, the slow ones below. Where they disagree with the
    model (chi-square per octave, see `bands`), the reading noise at the full rate is not white: the slow
    powers are then used whole, the fast ones above them with a quantization of their own, without as many of their
    highest octaves as necessary for the rest to fit. Q is then that of readings one cell apart, as the Allan deviation
    of the cell means shows it.
    Raises `BadParameter` and `UnfitRecording`.
    """
    for name, value in (("level", level), ("confidence", confidence)):
        if not 0.0 < value < 1.0:
            raise BadParameter(name, value, f"0 < {name} < 1")
    agreement = agreed(slow, fast)
    reduced, follows = followed(agreement.joined, candidates)
    agreement = replace(agreement, joined=reduced)
    joined, model = agreement.joined, agreement.model
    selection = select(joined.used, level)
    estimates, doubt = _estimates(agreement, selection, confidence)
    left = undescribed(agreement, hidden)
    estimates = limited(agreement, estimates, left, hidden)
    process = None if model is None else gauss_markov(agreement.plain, model, selection.free)
    fastest = float(np.min(joined.period_s))
    if model and process and like_a_filter(process, fastest) and estimates[RANDOM_WALK].described:
        process = replace(process, white=estimates[RANDOM_WALK].value)
        most = low_frequency_limit(joined, model, selection.best)
        estimates = tuple(bounded(e, most) if k == RANDOM_WALK else e for k, e in enumerate(estimates))
        left = tuple(sorted({*left, RANDOM_WALK}))
    correlated, correlation = _correlation(selection, left)
    octaves = joined.octaves(selection.best.variances, selection.best.amplitudes, selection.ramp)
    fitted = joined.frequency_hz[joined.fitted]
    return NoiseFit(
        METHOD,
        *estimates,
        slope=selection.slope.slope if estimates[-1].present else 0.0,
        confidence=confidence,
        correlated=correlated,
        correlation=correlation,
        octaves=octaves,
        lines=_lines(slow, fast),
        band_hz=(float(fitted[0]), float(fitted[-1])),
        remarks=(*agreement.remarks, *_left(left), *(_doubts(doubt) if doubt.strong else ())),
        notes=(*_remarks(selection), *(() if doubt.strong else _doubts(doubt))),
        followed=follows,
        gauss_markov=process,
        flicker_corner_s=None if model is None else model.corner_s,
    )


def _estimates(agreement: Agreement, selection: Selection, confidence: float) -> tuple[tuple[Estimate, ...], Doubt]:
    """Estimates of Q, N, B, K, R: values for the processes present, intervals that allow for the others as well.

    A process not observed is not proven absent: an interval that assumed it zero would be too narrow. The upper limit
    of an absent process allows for the ramp, too.
    """
    spectrum = agreement.joined.used
    slack = 1.0 if np.all(agreement.joined.fitted) else CHOSEN_BAND
    losses = slack * float(chdtri(1, 1.0 - confidence)), slack * _one_sided()
    everything = tuple(range(spectrum.columns.shape[1]))
    own, full = (maximum(s, everything) for s in (selection.spectrum, spectrum))
    fit_sd = _standard_uncertainties(selection.spectrum, selection.best, selection.free)
    own_sd = _standard_uncertainties(selection.spectrum, own, everything)
    full_sd = _standard_uncertainties(spectrum, full, everything)
    found: list[Estimate] = []
    for k in VARIANCES:
        p_value = selection.p_values[k]
        if k in selection.present:
            alone = Profile(selection.spectrum, selection.free, k, selection.best)
            allowed = Profile(selection.spectrum, everything, k, own)
            found.append(_present(((alone, fit_sd[k]), (allowed, own_sd[k])), p_value, losses, slack))
        else:
            limit = Profile(spectrum, everything, k, full).crossing(losses[1], upwards=True, scale=full_sd[k])
            found.append(Estimate(None, None, None, None, sqrt(limit), p_value))
    doubt = allowed_for(
        agreement.joined, agreement.plain, selection, own, dict(enumerate(found)), losses, agreement.model
    )
    found = [doubt.estimates.get(k, estimate) for k, estimate in enumerate(found)]
    return (*found, _of_ramp(selection, confidence)), doubt


def _one_sided() -> float:
    """Twice the loss of log likelihood at an upper limit: a one-sided interval is half of a two-sided one."""
    return float(chdtri(1, 2.0 * (1.0 - LIMIT)))


def _present(
    profiles: tuple[tuple[Profile, float], ...], p_value: float, losses: tuple[float, float], slack: float
) -> Estimate:
    """A process with variance v: ``coefficient = √v``, its uncertainty ``sd(v)/(2√v)``, its interval by profile.

    The profiles, each with sd(v): that of the processes present, then that of all. The interval is from the lowest to
    the highest end: the first alone ignores what was not observed, the second alone is low where all that it
    allows is absent, since variances cannot be negative (N alone: upper limits held in 76 % instead of 95 %).
    """
    first, sd = profiles[0]
    sd *= sqrt(slack)
    variance = float(first.best.variances[first.k])
    lower = min(p.crossing(losses[0], upwards=False, scale=s) for p, s in profiles)
    upper = max(p.crossing(losses[0], upwards=True, scale=s) for p, s in profiles)
    limit = max(p.crossing(losses[1], upwards=True, scale=s) for p, s in profiles)
    return Estimate(sqrt(variance), 0.5 * sd / sqrt(variance), sqrt(lower), sqrt(upper), sqrt(limit), p_value)


def _of_ramp(selection: Selection, confidence: float) -> Estimate:
    """The ramp |R| with Student's interval."""
    slope = selection.slope
    value, sd = abs(slope.slope), slope.standard_uncertainty
    limit = value + sd * slope.factor(LIMIT)
    if not selection.ramp:
        return Estimate(None, None, None, None, limit, slope.p_value)
    half = sd * slope.factor(0.5 * (1.0 + confidence))
    return Estimate(value, sd, max(0.0, value - half), value + half, limit, slope.p_value)


def _standard_uncertainties(spectrum: Spectrum, at: State, free: tuple[int, ...]) -> dict[int, float]:
    """Standard uncertainties of the free variances, from the Fisher information."""
    covariance = _covariance(spectrum, at, free)
    return {k: sqrt(float(covariance[i, i])) for i, k in enumerate(free)}


def _covariance(spectrum: Spectrum, at: State, free: tuple[int, ...]) -> Array:
    return inverse_information(information(spectrum, at)[np.ix_(free, free)])


def _correlation(selection: Selection, left: tuple[int, ...]) -> tuple[tuple[str, ...], Array]:
    """Names and correlation of the observed processes that are described; slope and variances are uncorrelated."""
    count = len(selection.present)
    covariance = _covariance(selection.spectrum, selection.best, selection.free)[:count, :count]
    sd = np.sqrt(np.diag(covariance))
    names = [PROCESSES[k] for k in selection.present]
    correlation = np.eye(count + selection.ramp)
    correlation[:count, :count] = covariance / np.outer(sd, sd)
    names += [PROCESSES[-1]] * selection.ramp
    kept = [i for i, name in enumerate(names) if PROCESSES.index(name) not in left]
    return tuple(names[i] for i in kept), correlation[np.ix_(kept, kept)]


def _remarks(selection: Selection) -> tuple[str, ...]:
    if not selection.ambiguous:
        return ()
    taken, other = ("rate ramp", "rate random walk")[:: 1 if selection.ramp else -1]
    return (f"The slow drift is taken for a {taken}, but one record does not distinguish it from a {other}.",)


def _doubts(doubt: Doubt) -> tuple[str, ...]:
    if doubt.model is None:
        return ()
    if doubt.model.time_s is None:
        other = f"a flicker whose shortest relaxation time is about {doubt.model.corner_s:.2g} s"
    else:
        other = f"a Gauss–Markov process of about {doubt.model.time_s:.2g} s"
    return (f"The slow noise may as well be {other}: the intervals of B and K allow for it.",)


def _lines(slow: Powers, fast: Powers | None) -> tuple[SpectralLine, ...]:
    """Spectral lines of the fast part, and of the slow part below it; fast modes resolve lines without aliasing."""
    if fast is None:
        return slow.lines
    cells_hz = 1.0 / slow.period_s
    seen = [line.frequency_hz for line in fast.lines]
    folded = [abs(f - cells_hz * round(f / cells_hz)) for f in seen]
    beside = _SAME_MODES * float(np.diff(fast.frequency_hz[:2])[0])
    own = [
        line
        for line in slow.lines
        if line.frequency_hz < _TOLD * cells_hz
        and not any(abs(f - line.frequency_hz) < beside for f in (*seen, *folded))
    ]
    return (*own, *fast.lines)


def _left(left: tuple[int, ...]) -> tuple[str, ...]:
    if not left:
        return ()
    names = ", ".join("QNBKR"[i] for i in left)
    return (f"Not described by the noise model, and given as limits only: {names}.",)
