"""Selection of the processes that a spectrum shows: likelihood ratios on the boundary, and a t test of the ramp.

A variance at its bound 0: twice the log likelihood ratio is 0 or χ²₁ with probability one half each (Self and Liang,
J. Am. Stat. Assoc. 82 (1987) 605), so ``p = ½·P(χ²₁ > T)``. Rule: of Q, N and B, remove the least significant while
its p is above the level; then add any whose p has fallen below it. The ramp is a mean: its slope over its
standard uncertainty has Student's distribution with Satterthwaite's degrees of freedom, ``2s⁴/Var(s²)``, since the
uncertainty itself depends on how well the slow powers are known (Kenward and Roger, Biometrics 53 (1997) 983).

Flicker, rate random walk and ramp explain the same slow motion. A drift is claimed only where the flicker, allowed,
does not explain it. Ramp and walk are each tested with the other allowed too; where neither is then needed, but one
of them is, the likelier one is taken and reported as ambiguous.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import erfc, sqrt

import numpy as np
from scipy.special import stdtr, stdtrit

from procedures.analysis.noise_fit.columns import BIAS_INSTABILITY, QUANTIZATION, RANDOM_WALK, RATE_RANDOM_WALK
from procedures.analysis.noise_fit.restricted import Spectrum, State, information, maximum
from procedures.core.arrays import Array

RAMP, ENDS = 0, (1, 2)
"""Regressors: the ramp; the first and the last reading, which are always free."""
VARIANCES = range(4)
"""Columns of Q², N², B², K²; a column after them is untested and always included."""
_OTHERS = (QUANTIZATION, RANDOM_WALK, BIAS_INSTABILITY)


@dataclass(frozen=True)
class Slope:
    """The ramp's slope in a fit, with its uncertainty."""

    slope: float
    standard_uncertainty: float
    dof: float
    """Student's degrees of freedom."""

    @property
    def p_value(self) -> float:
        """Two-sided p-value of the hypothesis of no slope."""
        return 2.0 * float(stdtr(self.dof, -abs(self.slope) / self.standard_uncertainty))

    def factor(self, probability: float) -> float:
        """Return Student's quantile at `probability`, with these degrees of freedom."""
        return float(stdtrit(self.dof, probability))


@dataclass(frozen=True)
class Selection:
    """Processes that were found in a spectrum, and the fit with them alone."""

    present: tuple[int, ...]
    """Indices in `VARIANCES`, ascending."""
    ramp: bool
    spectrum: Spectrum
    """The spectrum with the regressors of the fit."""
    best: State
    free: tuple[int, ...]
    """Variances of the fit: those present and the untested."""
    p_values: tuple[float, ...]
    """The p-values of Q, N, B, K, R."""
    slope: Slope
    """Slope from the fit if it has a ramp, else from the fit of all processes."""
    ambiguous: bool
    """A drift is present, but K and R cannot be distinguished."""


def select(spectrum: Spectrum, level: float) -> Selection:
    """Return the processes that a spectrum shows; its regressors are ramp, first and last reading, and others always
    kept.
    """
    untested = tuple(range(len(VARIANCES), spectrum.columns.shape[1]))
    sloped, flat = _Fits(spectrum, untested), _Fits(spectrum.without_ramp, untested)
    everything = slope_of(spectrum, sloped.best(VARIANCES))
    ramp, ambiguous = everything.p_value < level, False
    walk = (sloped if ramp else flat).p_value(VARIANCES, RATE_RANDOM_WALK) < level
    if not ramp:
        ramp, walk, ambiguous = _drift(sloped, flat, walk, level)
    fits = sloped if ramp else flat
    present = _chosen(fits, (RATE_RANDOM_WALK,) if walk else (), level)
    best = fits.best(present)
    slope = slope_of(spectrum, best) if ramp else everything
    p_values = [fits.p_value((*_OTHERS, RATE_RANDOM_WALK) if k == RATE_RANDOM_WALK else present, k) for k in VARIANCES]
    return Selection(
        present, ramp, fits.spectrum, best, (*present, *untested), (*p_values, slope.p_value), slope, ambiguous
    )


@dataclass
class _Fits:
    """Cached fits of one spectrum; the untested variances are always free."""

    spectrum: Spectrum
    untested: tuple[int, ...]
    _found: dict[frozenset[int], State] = field(default_factory=dict[frozenset[int], State])

    def best(self, present: Iterable[int]) -> State:
        """The fit with some of `VARIANCES`."""
        key = frozenset((*present, *self.untested))
        if key not in self._found:
            larger = [state for free, state in self._found.items() if free > key]
            start = larger[-1].variances if larger else None
            self._found[key] = maximum(self.spectrum, sorted(key), start=start)
        return self._found[key]

    def p_value(self, present: Iterable[int], k: int) -> float:
        """The p-value of variance k, given the other present ones."""
        others = [i for i in present if i != k]
        ratio = 2.0 * (self.best((*others, k)).log_likelihood - self.best(others).log_likelihood)
        return 0.5 * erfc(sqrt(0.5 * ratio)) if ratio > 0.0 else 1.0


def slope_of(spectrum: Spectrum, at: State, index: int = RAMP) -> Slope:
    """Return the slope of one regressor (default: the ramp) at a fitted state, with Satterthwaite's degrees of
    freedom.
    """
    s, inverse = spectrum, at.amplitude_covariance
    variance = float(inverse[index, index])
    by_variance = np.einsum("bk,bij->kij", s.columns / at.power[:, None] ** 2, s.gram)
    gradient = np.einsum("i,kij,j->k", inverse[index], by_variance, inverse[index])
    known = inverse_information(information(s, at))
    spread = float(gradient @ known @ gradient)
    return Slope(float(at.amplitudes[index]), sqrt(variance), max(1.0, 2.0 * variance**2 / spread))


def inverse_information(matrix: Array) -> Array:
    """Return the inverse of a Fisher matrix whose parameters differ by many orders of magnitude."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    return np.linalg.pinv(matrix * np.outer(scale, scale), hermitian=True) * np.outer(scale, scale)


def _drift(sloped: _Fits, flat: _Fits, walk: bool, level: float) -> tuple[bool, bool, bool]:
    """(ramp, rate random walk, ambiguous), where all others make the ramp needless; `walk`: the walk is needed."""
    without_walk = sloped.best(_OTHERS)
    with_slope = slope_of(sloped.spectrum, without_walk).p_value < level
    if not (with_slope or walk):
        return False, False, False
    if sloped.p_value(VARIANCES, RATE_RANDOM_WALK) < level:
        return False, True, False
    as_ramp = without_walk.plain_log_likelihood > flat.best(VARIANCES).plain_log_likelihood
    return as_ramp, not as_ramp, True


def _chosen(fits: _Fits, fixed: tuple[int, ...], level: float) -> tuple[int, ...]:
    """Backward elimination of Q, N, B, then forward inclusion, with the `fixed` ones always in."""
    present = list(_OTHERS)
    while len(present) + len(fixed) + len(fits.untested) > 1 and present:
        p_values = [fits.p_value((*present, *fixed), k) for k in present]
        worst = int(np.argmax(p_values))
        if p_values[worst] < level:
            break
        del present[worst]
    while absent := [k for k in _OTHERS if k not in present]:
        p_values = [fits.p_value((*present, *fixed), k) for k in absent]
        first = int(np.argmin(p_values))
        if p_values[first] >= level:
            break
        present.append(absent[first])
    return tuple(sorted((*present, *fixed)))
