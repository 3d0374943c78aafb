"""Slow and fast powers in one spectrum: which part of each is fitted, and how well the model describes each octave."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.noise_fit.columns import QUANTIZATION, RANDOM_WALK
from procedures.analysis.noise_fit.estimate import Octave
from procedures.analysis.noise_fit.goodness import deviates, judged
from procedures.analysis.noise_fit.powers import Powers
from procedures.analysis.noise_fit.restricted import Spectrum, maximum, only_where
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording

MISFIT_LEVEL = 1e-3
"""Probability that a fit of all octaves is rejected though the model holds."""
_FEWEST_BINS = 8
_FEWEST_OCTAVES = 3
"""So many must be left to fit."""
_LONGEST_HOLE = 3
"""Octaves of a part left out that has fitted ones on both sides."""
_ROUNDS = 3
_PROCESSES = 4


@dataclass(frozen=True)
class Joined:
    """Slow and fast bins in one spectrum, (b,), and which of them are fitted."""

    frequency_hz: Array
    is_fast: NDArray[np.bool_]
    spectrum: Spectrum
    fitted: NDArray[np.bool_]
    white: Array
    """Expected power for unit N², (b,)."""

    @property
    def used(self) -> Spectrum:
        """The fitted bins."""
        return only_where(self.fitted, self.spectrum)

    @property
    def group(self) -> NDArray[np.int64]:
        """Number of each bin's octave from 0, slow and fast apart, (b,)."""
        key = np.floor(np.log2(self.frequency_hz)) * 2 + self.is_fast
        return np.unique(key, return_inverse=True)[1].astype(np.int64)

    def without(self, groups: range) -> "Joined":
        """The same, some octaves not fitted, and an edge of the white noise allowed for."""
        group = self.group
        return replace(self, fitted=self.fitted & ~((group >= groups.start) & (group < groups.stop)))._edged()

    def _edged(self) -> "Joined":
        """White noise that falls or rises towards the highest fitted frequency f₁, in its own and a fifth column.

        ``N²·(1 − x²) + q·x²``, x = f/f₁, q ≥ 0: the first term of any filter's edge, and of any reading noise. A band
        that merely ends where a misfit is seen would take the unseen part of the edge for less white noise.
        """
        s, white = self.spectrum, self.white
        x2 = np.minimum(1.0, (self.frequency_hz / float(np.max(self.frequency_hz[self.fitted]))) ** 2)
        columns = np.column_stack([s.columns[:, :_PROCESSES], x2 * white])
        columns[:, RANDOM_WALK] = (1.0 - x2) * white
        return replace(self, spectrum=replace(s, columns=columns))

    def octaves(self, variances: Array, amplitudes: Array, ramp: bool) -> tuple[Octave, ...]:
        """Goodness of the bins in each octave, slow and fast apart, and fitted and left out apart."""
        s = self.spectrum if ramp else self.spectrum.without_ramp
        z = deviates(s, variances, amplitudes)
        key = self.group * 2 + ~self.fitted
        found: list[Octave] = []
        for one in np.unique(key):
            own = key == one
            frequency = self.frequency_hz[own]
            fitted, is_fast = bool(self.fitted[own][0]), bool(self.is_fast[own][0])
            ends = float(frequency[0]), float(frequency[-1])
            found.append(Octave(*ends, *judged(z[own]), is_fast, fitted))
        return tuple(found)


@dataclass(frozen=True)
class Agreement:
    """The bins to fit, and what was left out of them."""

    joined: Joined
    remarks: tuple[str, ...]
    holes: NDArray[np.bool_]
    """Bins left out that have fitted ones above them, (b,): what only they show is not described."""
    described: bool
    """Whether what is fitted fits."""


def agreed(slow: Powers, fast: Powers | None) -> Agreement:
    """The bins to fit, and sentences on what was left out of them. Raises `UnfitRecording`."""
    if fast is None:
        alone = joined_at(slow, None, inf)
        return _whole(alone) if fits(alone) else _parted(alone, "")
    crossover = float(fast.frequency_hz[0])
    if np.sum(slow.frequency_hz < crossover) < _FEWEST_BINS:
        raise UnfitRecording(f"fewer than {_FEWEST_BINS} bins below {crossover:.3g} Hz: fit the slow powers alone")
    whole = joined_at(slow, fast, crossover)
    if fits(whole):
        return _whole(whole)
    apart = joined_at(slow, fast, 0.5 / slow.period_s)
    own = f"; Q is that of readings {slow.period_s:g} s apart"
    if fits(apart):
        text = f"At the full rate the power is not that of white reading noise and the slower processes{own}."
        return replace(_whole(apart), remarks=(text,))
    return _parted(apart, own)


def joined_at(slow: Powers, fast: Powers | None, crossover_hz: float) -> Joined:
    """Slow bins below the crossover and fast ones above.

    Fast bins that do not follow the slow ones at once have a quantization of their own, in a fifth column.
    """
    parts = [(slow, slow.frequency_hz < crossover_hz)]
    if fast is not None:
        parts.append((fast, fast.frequency_hz >= crossover_hz))
    counts = [int(np.sum(keep)) for _, keep in parts]
    is_fast = np.repeat([False, True], [*counts, 0][:2])
    frequency = np.concatenate([p.frequency_hz[keep] for p, keep in parts])
    columns = np.concatenate([p.columns[keep] for p, keep in parts])
    if fast is not None and crossover_hz > fast.frequency_hz[0] and np.any(is_fast):
        own = np.where(is_fast, columns[:, QUANTIZATION], 0.0)
        columns = np.column_stack([columns, own])
        columns[is_fast, QUANTIZATION] = 0.0
    dof = np.concatenate([p.dof[keep] for p, keep in parts])
    power = np.concatenate([p.power[keep] for p, keep in parts])
    products = np.concatenate([p.products[keep] for p, keep in parts])
    gram = np.concatenate([p.gram[keep] for p, keep in parts])
    spectrum = Spectrum(power * dof, dof, columns, products, gram)
    return Joined(frequency, is_fast, spectrum, np.ones(len(frequency), dtype=bool), columns[:, RANDOM_WALK].copy())


def fits(joined: Joined) -> bool:
    """Whether all fitted octaves fit; the fit has all processes and a ramp."""
    return misfit(joined) <= 1.0


def misfit(joined: Joined) -> float:
    """Logarithm of the least p-value of the fitted octaves over that of the test's level; above 1 the fit is rejected."""
    best = maximum(joined.used, range(joined.spectrum.columns.shape[1]))
    if best.log_likelihood == -np.inf:
        return inf
    octaves = [o for o in joined.octaves(best.variances, best.amplitudes, ramp=True) if o.fitted]
    least = max(min(o.p_value for o in octaves), 1e-300)
    return float(np.log(least) / np.log(MISFIT_LEVEL / len(octaves)))


def _whole(joined: Joined) -> Agreement:
    return Agreement(joined, (), ~joined.fitted, described=True)


def _parted(joined: Joined, own: str) -> Agreement:
    """Leaves out the fewest octaves in a row that it takes until the others fit; again, if need be, thrice at most."""
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
    for run in runs:  # what is not seen of a misfit's foot is more than its interval allows
        wider = part.without(range(max(0, run.start - 1), run.stop + 1))
        if len(np.unique(wider.group[wider.fitted])) >= _FEWEST_OCTAVES:
            part = wider
    return _told(part, own, described=described)


def _runs(joined: Joined) -> Iterator[range]:
    """Octaves in a row that may be left out, the shortest first; of as many, those at the upper end first."""
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
    """The remarks on what is left out."""
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
