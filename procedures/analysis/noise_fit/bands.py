"""Slow and fast powers in one spectrum: the parts that are fitted, and the goodness of fit of each octave."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.noise_fit.extensions import Extension, extension, fast_extension
from procedures.analysis.noise_fit.joined import Joined, joined_at
from procedures.analysis.noise_fit.powers import Powers
from procedures.analysis.noise_fit.restricted import State, maximum
from procedures.core.errors import UnfitRecording

MISFIT_LEVEL = 1e-3
"""Probability that a fit of all octaves is rejected although the model holds."""
_FEWEST_BINS = 8
_FEWEST_OCTAVES = 3
"""Fewest octaves that must remain for the fit."""
_LONGEST_HOLE = 3
"""Most octaves of an excluded part with fitted octaves on both sides."""
_ROUNDS = 3
_GAINED = 8.0
"""Least ratio of the top of the band that a fast extension describes to that without it."""
_UNFOLDED = 4.0
"""Share of the cell frequency; with a band that ends above it, the cells lack less than 2 % of the noise beyond."""
_SLOW_PART = 0.2
"""Share of the cell frequency up to which the slow model is chosen where no whole spectrum fits."""


@dataclass(frozen=True)
class Agreement:
    """Bins to fit, the model that they need, and remarks on the excluded bins."""

    joined: Joined
    remarks: tuple[str, ...]
    holes: NDArray[np.bool_]
    """Excluded bins below a fitted one, (b,); a process that only they show is not described."""
    described: bool
    """True if the model fits the bins that are fitted."""
    model: Extension | None = None
    """The extension of the five-coefficient model, if it needs one."""

    @property
    def plain(self) -> Joined:
        """The same bins without the columns of the extension."""
        return self.joined if self.model is None else self.model.taken_from(self.joined)


def agreed(slow: Powers, fast: Powers | None) -> Agreement:
    """Return the bins to fit and the model they need, with remarks on the excluded bins. Raises `UnfitRecording`.
    `fast` None: the slow bins alone.
    """
    ways = _ways(slow, fast)
    found, state = _first_that_fits(ways)
    base = ways[-1].joined.below(_SLOW_PART / slow.period_s) if found is None else found.joined
    model = extension(base, state or _best(base))
    extended = ways
    if model is not None:
        extended = tuple(replace(way, joined=model.applied(way.joined)) for way in ways)
        found, _ = _first_that_fits(extended)
    if found is None and (faster := _faster(ways[0].joined)) is not None:
        return faster
    if found is None:
        cut = replace(_cut(extended, _UNFOLDED / slow.period_s), model=model)
        return _faster_below_an_edge(ways[0].joined, cut) or cut
    text = f"At the full rate the power is not that of white reading noise and the slower processes{found.own}."
    return Agreement(found.joined, (text,) if found.own else (), ~found.joined.fitted, described=True, model=model)


def _faster(joined: Joined) -> Agreement | None:
    """Return the fitted bins with an extension that acts at the full rate, if the model then fits them."""
    found = fast_extension(joined, _best(joined))
    if found is None:
        return None
    model, state = found
    extended = model.applied(joined)
    if misfit(extended, state) > 1.0:
        return None
    return replace(_told(extended, "", described=True), model=model)


def _faster_below_an_edge(joined: Joined, cut: Agreement) -> Agreement | None:
    """Return the bins below a filter's edge with such an extension, if it describes far more octaves than the `cut`.

    The band is halved until it fits, then twice more: the undetected flank of a misfit exceeds what the intervals allow
    for. A filter's edge alone leaves a cut band that is nearly as wide.
    """
    frequency, fitted = cut.joined.frequency_hz, cut.joined.fitted
    top = float(frequency[fitted][-1])
    holes = frequency[~fitted & (frequency < top)]
    least = _GAINED * top if len(holes) == 0 else 2.0 * float(holes[-1])
    highest = 0.5 * float(joined.frequency_hz[-1])
    while highest >= least:
        found = _faster(joined.below(highest))
        if found is not None:
            return _faster(joined.below(0.25 * highest)) or found
        highest *= 0.5
    return None


@dataclass(frozen=True)
class _Way:
    """Slow and fast bins joined in one of two ways."""

    joined: Joined
    own: str
    """Clause of the remark on Q where the fast bins have a Q of their own."""


def _ways(slow: Powers, fast: Powers | None) -> tuple[_Way, ...]:
    """The ways to join slow and fast bins, the most informative first."""
    if fast is None:
        return (_Way(joined_at(slow, None, inf), ""),)
    crossover = float(fast.frequency_hz[0])
    if np.sum(slow.frequency_hz < crossover) < _FEWEST_BINS:
        raise UnfitRecording(f"fewer than {_FEWEST_BINS} bins below {crossover:.3g} Hz: fit the slow powers alone")
    own = f"; Q is that of readings {slow.period_s:g} s apart"
    return _Way(joined_at(slow, fast, crossover), ""), _Way(joined_at(slow, fast, 0.5 / slow.period_s), own)


def _first_that_fits(ways: tuple[_Way, ...]) -> tuple[_Way | None, State | None]:
    for way in ways:
        state = _best(way.joined)
        if misfit(way.joined, state) <= 1.0:
            return way, state
    return None, None


def _best(joined: Joined) -> State:
    """Fit all processes and a ramp."""
    return maximum(joined.used, range(joined.spectrum.columns.shape[1]))


def misfit(joined: Joined, best: State | None = None) -> float:
    """Return the logarithm of the least p-value of the fitted octaves over that of the test's level: above 1 the model
    does not fit. `best`: the state of greatest likelihood, found here where None.
    """
    best = best or _best(joined)
    if best.log_likelihood == -np.inf:
        return inf
    octaves = [o for o in joined.octaves(best.variances, best.amplitudes, ramp=True) if o.fitted]
    least = max(min(o.p_value for o in octaves), 1e-300)
    return float(np.log(least) / np.log(MISFIT_LEVEL / len(octaves)))


def _cut(ways: tuple[_Way, ...], unfolded_hz: float) -> Agreement:
    """Exclude the bins that do not fit. Cell means alias faster noise into their band, and lack it where a filter took
    it away: where the band ends low, only their bins below that end are used, and the fast bins above."""
    part = _parted(ways[-1].joined, ways[-1].own)
    top = float(part.joined.frequency_hz[part.joined.fitted][-1])
    first = ways[0].joined
    if len(ways) == 1 or top > unfolded_hz or not np.any(first.is_fast & (first.frequency_hz < top)):
        return part
    below = first.below(np.nextafter(top, inf))
    own = "; Q is not separated from the edge"
    return _told(below, own, described=True) if misfit(below) <= 1.0 else _parted(first, own)


def _parted(joined: Joined, own: str) -> Agreement:
    """Exclude the shortest run of octaves that lets the others fit; repeat if necessary, three times at most."""
    runs: list[range] = []
    part, described = joined, False
    for _ in range(_ROUNDS):
        best, least = None, inf
        for run in _runs(part):
            found = misfit(part.without(run))
            if found < least:
                best, least = run, found
            if found <= 1.0:
                break
        if best is None:
            break
        runs.append(best)
        part, described = part.without(best), least <= 1.0
        if described:
            break
    for run in runs:  # the undetected flank of a misfit exceeds what the intervals allow for
        wider = part.without(range(max(0, run.start - 1), run.stop + 1))
        if len(np.unique(wider.group[wider.fitted])) >= _FEWEST_OCTAVES:
            part = wider
    return _told(part, own, described=described)


def _runs(joined: Joined) -> Iterator[range]:
    """Runs of octaves that may be excluded, the shortest first; among equal lengths, those at the upper end first."""
    octaves = np.unique(joined.group[joined.fitted])
    slow = set(joined.group[joined.fitted & ~joined.is_fast].tolist())
    count = len(octaves)
    for length in range(1, count - _FEWEST_OCTAVES + 1):
        starts = range(count - length, -1, -1) if length <= _LONGEST_HOLE else (count - length, 0)
        for start in starts:
            run = range(int(octaves[start]), int(octaves[start + length - 1]) + 1)
            if not slow <= set(run):
                yield run


def _told(part: Joined, own: str, *, described: bool) -> Agreement:
    """Add the remarks on the excluded bins."""
    frequency, fitted = part.frequency_hz, part.fitted
    top = float(frequency[fitted][-1])
    remarks: list[str] = []
    if frequency[-1] > top:
        begin = "At the full rate the power" if own else "The power"
        remarks.append(
            f"{begin} is not that of white reading noise and the slower processes; above "
            f"{top:.3g} Hz it is left out{own}."
        )
    elif own:
        remarks.append(f"At the full rate the power is not that of the slow part{own}.")
    holes = ~fitted & (frequency < top)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], holes, [0]]).astype(np.int8))).reshape(-1, 2)
    for first, end in edges:
        low, high = frequency[first], frequency[end - 1]
        remarks.append(f"Between {low:.3g} and {high:.3g} Hz the power is not that of the noise model: left out.")
    if not described:
        remarks.append("The noise model describes no part of the spectrum that would tell the coefficients.")
    return Agreement(part, tuple(remarks), holes, described)
