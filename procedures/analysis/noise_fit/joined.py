"""Slow and fast powers in one spectrum, octave by octave: the fitted bins, and the goodness of fit."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.noise_fit.columns import BIAS_INSTABILITY, QUANTIZATION, RANDOM_WALK
from procedures.analysis.noise_fit.estimate import Octave
from procedures.analysis.noise_fit.goodness import deviates, judged
from procedures.analysis.noise_fit.powers import Powers
from procedures.analysis.noise_fit.restricted import Spectrum, only_where
from procedures.core.arrays import Array

_PROCESSES = 4
_BESIDE = 4
"""Modes of a segment, on each side of a slow line."""


@dataclass(frozen=True)
class Joined:
    """Slow and fast bins in one spectrum, (b,), and which of them are fitted."""

    frequency_hz: Array
    is_fast: NDArray[np.bool_]
    spectrum: Spectrum
    fitted: NDArray[np.bool_]
    white: Array
    """Expected power for unit N², (b,)."""
    flicker: Array
    """Expected power for unit B², (b,), before an extension of the model changes it."""
    period_s: Array
    """Sampling period of the data behind each bin, (b,)."""
    added: int = 0
    """Columns at the end that an extension of the model added."""

    @property
    def used(self) -> Spectrum:
        """The spectrum of the fitted bins alone."""
        return only_where(self.fitted, self.spectrum)

    @property
    def group(self) -> NDArray[np.int64]:
        """Number of each bin's octave from 0, separately for slow and fast bins, (b,)."""
        key = np.floor(np.log2(self.frequency_hz)) * 2 + self.is_fast
        return np.unique(key, return_inverse=True)[1].astype(np.int64)

    def without(self, groups: range) -> "Joined":
        """Return the same bins with some octaves excluded from the fit, allowing for an edge of the white noise."""
        group = self.group
        return replace(self, fitted=self.fitted & ~((group >= groups.start) & (group < groups.stop)))._edged()

    def with_regressors(self, keep: Sequence[int]) -> "Joined":
        """Return the same bins with only the regressors of these indices."""
        return replace(self, spectrum=self.spectrum.only(keep))

    def below(self, highest_hz: float) -> "Joined":
        """Return the same bins, fitted below a frequency only."""
        return replace(self, fitted=self.fitted & (self.frequency_hz < highest_hz))._edged()

    def _edged(self) -> "Joined":
        """White noise that falls or rises towards the highest fitted frequency f₁, in its own and a fifth column.

        ``N²·(1 − x²) + q·x²``, x = f/f₁, q ≥ 0: the first term of any filter's edge, and of any reading noise. A band
        that merely ends at a visible misfit would take the invisible part of the edge for less white noise.
        """
        s, white = self.spectrum, self.white
        x2 = np.minimum(1.0, (self.frequency_hz / float(np.max(self.frequency_hz[self.fitted]))) ** 2)
        added = s.columns[:, s.columns.shape[1] - self.added :]
        columns = np.column_stack([s.columns[:, :_PROCESSES], x2 * white, added])
        columns[:, RANDOM_WALK] = (1.0 - x2) * white
        return replace(self, spectrum=replace(s, columns=columns))

    def octaves(self, variances: Array, amplitudes: Array, ramp: bool) -> tuple[Octave, ...]:
        """Return the goodness of fit of each octave, separately for slow and fast, and for fitted and excluded bins.
        `ramp`: the model had a ramp.
        """
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


def joined_at(slow: Powers, fast: Powers | None, crossover_hz: float) -> Joined:
    """Return slow bins below the crossover and fast ones above, as one spectrum.

    Fast bins that do not follow the slow ones at once have a quantization of their own, in a fifth column. `fast` None:
    the slow bins alone.
    """
    parts = [(slow, slow.frequency_hz < crossover_hz)]
    if fast is not None:
        parts.append((fast, (fast.frequency_hz >= crossover_hz) & _clear(slow, fast)))
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
    regressors = slow.products.shape[1]
    products, gram = np.zeros((len(dof), regressors)), np.zeros((len(dof), regressors, regressors))
    products[: counts[0]], gram[: counts[0]] = slow.products[parts[0][1]], slow.gram[parts[0][1]]
    period = np.concatenate([np.full(count, p.period_s) for (p, _), count in zip(parts, counts, strict=True)])
    white, flicker = columns[:, RANDOM_WALK].copy(), columns[:, BIAS_INSTABILITY].copy()
    spectrum = Spectrum(power * dof, dof, columns, products, gram)
    return Joined(frequency, is_fast, spectrum, np.ones(len(frequency), dtype=bool), white, flicker, period)


def _clear(slow: Powers, fast: Powers) -> NDArray[np.bool_]:
    """Mask of the fast bins that are free of the slow part's lines, which the full-rate samples still contain."""
    clear = np.ones(len(fast.frequency_hz), dtype=bool)
    beside = _BESIDE * float(fast.frequency_hz[1] - fast.frequency_hz[0]) if len(clear) > 1 else 0.0
    for line in slow.lines:
        clear &= np.abs(fast.frequency_hz - line.frequency_hz) > beside
    return clear
