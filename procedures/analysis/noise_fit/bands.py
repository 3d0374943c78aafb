"""Slow and fast powers in one spectrum: which part of each is fitted, and how well the model describes each octave."""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, gammainc, gammaincc, ndtri

from procedures.analysis.noise_fit.columns import QUANTIZATION
from procedures.analysis.noise_fit.estimate import Octave
from procedures.analysis.noise_fit.powers import Powers
from procedures.analysis.noise_fit.restricted import Spectrum, maximum, only_where
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording

MISFIT_LEVEL = 1e-3
"""Probability that a fit of all fast octaves is rejected though the model holds."""
_FEWEST_BINS = 8
_LARGEST_Z = 38.0


@dataclass(frozen=True)
class Joined:
    """Slow and fast bins in one spectrum, (b,), and which of them are fitted."""

    frequency_hz: Array
    is_fast: NDArray[np.bool_]
    spectrum: Spectrum
    fitted: NDArray[np.bool_]

    @property
    def used(self) -> Spectrum:
        """The fitted bins."""
        return only_where(self.fitted, self.spectrum)

    def octaves(self, variances: Array, amplitudes: Array, ramp: bool) -> tuple[Octave, ...]:
        """Chi-square of the bins in each octave, slow and fast apart, and fitted and left out apart.

        A bin's power over its expectation is χ²_ν/ν; its quantile as a normal deviate z, ``χ² = Σ z²``.
        """
        s = self.spectrum if ramp else self.spectrum.only((1, 2))
        explained = 2.0 * s.products @ amplitudes - np.einsum("i,bij,j->b", amplitudes, s.gram, amplitudes)
        ratio = np.maximum(s.squares - explained, 0.0) / (s.columns @ variances)
        half = 0.5 * s.dof
        z = np.where(ratio < s.dof, ndtri(gammainc(half, 0.5 * ratio)), -ndtri(gammaincc(half, 0.5 * ratio)))
        z = np.clip(z, -_LARGEST_Z, _LARGEST_Z)
        group = np.floor(np.log2(self.frequency_hz)) * 4 + 2 * self.is_fast + ~self.fitted
        found: list[Octave] = []
        for key in np.unique(group):
            own = group == key
            frequency = self.frequency_hz[own]
            chi_square, dof = float(np.sum(z[own] ** 2)), int(np.sum(own))
            p_value = float(chdtrc(dof, chi_square))
            fitted = bool(self.fitted[own][0])
            is_fast = bool(self.is_fast[own][0])
            found.append(Octave(float(frequency[0]), float(frequency[-1]), chi_square, dof, p_value, is_fast, fitted))
        return tuple(found)


def agreed(slow: Powers, fast: Powers | None) -> tuple[Joined, list[str]]:
    """The bins to fit, and sentences on what was left out of them. Raises `UnfitRecording`."""
    if fast is None:
        return joined_at(slow, None, inf, inf), []
    crossover = float(fast.frequency_hz[0])
    if np.sum(slow.frequency_hz < crossover) < _FEWEST_BINS:
        raise UnfitRecording(f"fewer than {_FEWEST_BINS} bins below {crossover:.3g} Hz: fit the slow powers alone")
    whole = joined_at(slow, fast, crossover, inf)
    if fitting_octaves(whole)[0]:
        return whole, []
    nyquist, highest = 0.5 / slow.period_s, inf
    while True:
        part = joined_at(slow, fast, nyquist, highest)
        fits, top_hz = fitting_octaves(part)
        if fits:
            break
        highest = top_hz
    text = "the power is not that of white reading noise and the slower processes"
    if not np.any(part.is_fast & part.fitted):
        return part, [f"Above {nyquist:.3g} Hz {text}: left out; Q is that of readings {slow.period_s:g} s apart."]
    above = "" if highest == inf else f"; above {highest:.3g} Hz it is left out"
    return part, [f"At the full rate {text}{above}; Q is that of readings {slow.period_s:g} s apart."]


def joined_at(slow: Powers, fast: Powers | None, crossover_hz: float, highest_hz: float) -> Joined:
    """Slow bins below the crossover and fast ones above; those above `highest_hz` are there, but not fitted.

    Fast bins that do not follow the slow ones at once have a quantization of their own, in a fifth column.
    """
    parts = [(slow, slow.frequency_hz < crossover_hz)]
    if fast is not None:
        parts.append((fast, fast.frequency_hz >= crossover_hz))
    counts = [int(np.sum(keep)) for _, keep in parts]
    is_fast = np.repeat([False, True], [*counts, 0][:2])
    frequency = np.concatenate([p.frequency_hz[keep] for p, keep in parts])
    columns = np.concatenate([p.columns[keep] for p, keep in parts])
    fitted = ~is_fast | (frequency < highest_hz)
    if fast is not None and crossover_hz > fast.frequency_hz[0] and np.any(is_fast & fitted):
        own = np.where(is_fast, columns[:, QUANTIZATION], 0.0)
        columns = np.column_stack([columns, own])
        columns[is_fast, QUANTIZATION] = 0.0
    dof = np.concatenate([p.dof[keep] for p, keep in parts])
    power = np.concatenate([p.power[keep] for p, keep in parts])
    products = np.concatenate([p.products[keep] for p, keep in parts])
    gram = np.concatenate([p.gram[keep] for p, keep in parts])
    return Joined(frequency, is_fast, Spectrum(power * dof, dof, columns, products, gram), fitted)


def fitting_octaves(joined: Joined) -> tuple[bool, float]:
    """Whether all fitted fast octaves fit, and where the highest of them begins [Hz].

    The fit has all processes and a ramp. With no fast octave fitted there is nothing to object to.
    """
    if not np.any(joined.is_fast & joined.fitted):
        return True, inf
    best = maximum(joined.used, range(joined.spectrum.columns.shape[1]))
    octaves = joined.octaves(best.variances, best.amplitudes, ramp=True)
    fast = [o for o in octaves if o.fitted and o.is_fast]
    return all(o.p_value >= MISFIT_LEVEL / len(fast) for o in fast), fast[-1].low_hz
