"""The members of the Allan family, and their cluster sizes. Formulas only, no samples.

With x the running sum of the rate, ``x_k = Σ_{i<k} y_i`` (k = 0…N), m the cluster size and Δ_m the difference over m,
every member is a mean square of a difference (NIST SP 1065, 5.2):

* Allan (eq. 8, 11) ``σ² = ⟨(Δ_m² x)²⟩ / 2m²``; Hadamard (eq. 17, 18) ``σ² = ⟨(Δ_m³ x)²⟩ / 6m²``;
* modified Allan (eq. 14) ``σ² = ⟨(Δ_m³ S)²⟩ / 2m⁴`` with ``S_k = Σ_{i<k} x_i``;
* time deviation (eq. 15) ``τ/√3 · σ_modified``.

Overlapping members take every start k, the others k = 0, m, 2m… as the thesis's script does.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb, log10

import numpy as np
from numpy.typing import NDArray

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording

Sizes = NDArray[np.int64]

FEWEST_SAMPLES = 12
"""Fewest samples for an Allan deviation."""


@dataclass(frozen=True)
class Statistic:
    """One member of the Allan family: name, order of its difference, overlapping or not, modified or not."""

    name: str
    order: int
    """Number d of differences of x: 2 for Allan, 3 for Hadamard."""
    overlapping: bool
    modified: bool = False
    is_time: bool = False
    """Scaled by τ/√3 to a time (for a gyro: angle) deviation."""

    @property
    def differences(self) -> int:
        """Number p of differences of the series: x, or (modified) its running sum."""
        return self.order + self.modified

    def starts(self, count: int, m: int) -> int:
        """Return the number of starts k where a term of cluster size m fits into `count` samples; non-overlapping: of
        terms.
        """
        last = count + self.modified - self.differences * m
        if last < 0:
            return 0
        return last + 1 if self.overlapping else last // m + 1

    def largest(self, count: int) -> int:
        """Return the largest cluster size at which one term fits into `count` samples."""
        return (count + self.modified) // self.differences

    def variance(self, sums: Array, terms: Array, sizes: Sizes, rate_hz: float) -> Array:
        """Return σ² [rate²] from sums of squared differences, (k,); of the time deviation [(rate·s)²]."""
        m = sizes.astype(np.float64)
        squared = m**4 if self.modified else m**2
        variance = sums / (np.maximum(terms, 1.0) * squared * comb(2 * self.order - 2, self.order - 1))
        return variance * (m / rate_hz) ** 2 / 3.0 if self.is_time else variance


ALLAN = Statistic("allan", 2, overlapping=False)
OVERLAPPING_ALLAN = Statistic("overlapping_allan", 2, overlapping=True)
MODIFIED_ALLAN = Statistic("modified_allan", 2, overlapping=True, modified=True)
TIME = Statistic("time", 2, overlapping=True, modified=True, is_time=True)
HADAMARD = Statistic("hadamard", 3, overlapping=False)
OVERLAPPING_HADAMARD = Statistic("overlapping_hadamard", 3, overlapping=True)
STATISTICS = {s.name: s for s in (ALLAN, OVERLAPPING_ALLAN, MODIFIED_ALLAN, TIME, HADAMARD, OVERLAPPING_HADAMARD)}


def log_sizes(largest: int, number: int = 200) -> Sizes:
    """Return cluster sizes 1…largest, evenly in the logarithm, whole and without repetition: the thesis's rule."""
    spread = np.floor(np.exp(np.linspace(0.0, np.log(max(largest, 1)), number))).astype(np.int64)
    return np.unique(np.append(spread[:-1], max(largest, 1)))


def decade_sizes(largest: int, step: float) -> Sizes:
    """Return cluster sizes with a step in decades (paper A: 0.002), whole and without repetition. Raises `BadParameter`
    for a step that is not positive.
    """
    if not 0.0 < step <= 1.0:
        raise BadParameter("step", step, "0 < step ≤ 1 decade")
    return np.unique(np.round(10.0 ** np.arange(0.0, log10(max(largest, 1)) + 1e-9, step)).astype(np.int64))


def octave_sizes(largest: int) -> Sizes:
    """Return cluster sizes 1, 2, 4 … up to `largest`."""
    return 1 << np.arange(max(largest, 1).bit_length(), dtype=np.int64)


def one_two_four_sizes(largest: int) -> Sizes:
    """Return cluster sizes 1, 2, 4, 10, 20, 40 … up to `largest`."""
    sizes = np.array([d * 10**e for e in range(len(str(max(largest, 1)))) for d in (1, 2, 4)], np.int64)
    return sizes[sizes <= max(largest, 1)]


def checked_sizes(sizes: Sequence[int] | Sizes | None, count: int, statistic: Statistic) -> Sizes:
    """Return the requested cluster sizes, ascending, or the default ones. Raises `UnfitRecording` and
    `BadParameter`.
    """
    if count < FEWEST_SAMPLES:
        raise UnfitRecording(f"{count} samples are too few for an Allan deviation; the least is {FEWEST_SAMPLES}")
    largest = statistic.largest(count)
    if sizes is None:
        return log_sizes(largest)
    wanted = np.unique(np.asarray(sizes, dtype=np.float64))
    if len(wanted) == 0 or not np.all(np.isfinite(wanted)) or np.any(wanted != np.floor(wanted)):
        raise BadParameter("sizes", list(wanted[:5]), "whole cluster sizes, at least one")
    if wanted[0] < 1 or wanted[-1] > largest:
        bad = wanted[0] if wanted[0] < 1 else wanted[-1]
        raise BadParameter("sizes", int(bad), f"1 to {largest} samples, for {statistic.name} of {count} samples")
    return wanted.astype(np.int64)
