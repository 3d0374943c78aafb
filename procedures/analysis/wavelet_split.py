"""Split of a signal by thresholded wavelets (thesis 3.1.2, appendix A) into a kept part and removed noise.

The only file that imports pywt. The details d of each level are shrunk softly by a threshold of the `heursure` rule
(the thesis's ``wden(v, 'heursure', 's', 'one', 6, 'sym8')``; Donoho, Johnstone, J. Am. Stat. Assoc. 90, 1995). For n
details of unit noise it is the universal ``√(2 ln n)`` where ``(Σd² − n)/n < (log₂ n)^1.5/√n``, else the lesser of
that and the t that makes Stein's unbiased risk ``n − 2·#{|d| ≤ t} + Σ min(d², t²)`` least.

The definition of unit noise decides the split:

* "thesis": no rescaling, so unit noise means *one unit of the series*, which the thesis had in deg/h; `unit_size` sets
  it. The same record in other units is split differently.
* "rescaled": unit noise is each level's own, its details' median absolute deviation over 0.6745: no unit matters.

J levels reach to 2^J samples, a *time*: 64 s at the thesis's 1 Hz and 0.64 s at 100 Hz. Quantization is averaged away
within it, and so is every other noise: a random walk is to be read at averaging times well above,
τ of at least eight times that scale.

The record is continued at its ends by its mirror image (half-sample symmetric), which makes no step there.
"""

import re
from dataclasses import dataclass
from math import log, log2, sqrt
from typing import Literal

import numpy as np
import pywt

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording

Rule = Literal["thesis", "rescaled"]
EDGES = "symmetric"
_NORMAL_MAD = 0.6745


@dataclass(frozen=True)
class Level:
    """Thresholding of one level of a wavelet split, of which 1 is the finest."""

    number: int
    from_s: float
    """Time scales of its details: about 2^(j−1) to 2^j cells [s]."""
    to_s: float
    details: int
    noise: float
    """Size of the unit noise [unit of the series]."""
    threshold: float
    """[unit of the series]"""
    shrunk_to_zero: float
    """Share of the details that were not above the threshold."""


@dataclass(frozen=True)
class WaveletSplit:
    """Result of a split; ``kept + removed`` is the signal, to rounding."""

    kept: Array
    """(n,) [unit of the series]"""
    removed: Array
    """(n,) [unit of the series]"""
    levels: tuple[Level, ...]
    """The levels, the finest first."""
    wavelet: str
    rule: Rule
    edge_s: float
    """Distance [s] from an end within which the mirror image affects the kept part."""


def wavelet_split(
    cells: Array,
    cell_s: float,
    *,
    rule: Rule,
    unit_size: float | None = None,
    wavelet: str = "sym8",
    levels: int = 6,
) -> WaveletSplit:
    """Split a series (n,) of means over cells of `cell_s` [s], in any unit.

    `unit_size` is for the rule "thesis" alone: its unit noise, in the unit of the series
    (`units.DEG_PER_HOUR` for a series in rad/s to be split as the thesis did). Raises `BadParameter` for a wavelet that
    is not orthogonal, for levels that the series is too short for, for a unit that is missing or has no use, and
    `UnfitRecording` for values that are not finite.
    """
    length = _checked(cells, cell_s, rule, unit_size, wavelet, levels)
    # the mean would only add rounding: it belongs to the coarsest part, which is kept
    mean = float(np.mean(cells))
    parts = pywt.wavedec(cells - mean, wavelet, mode=EDGES, level=levels)
    done: list[Level] = []
    for j in range(1, levels + 1):
        details = np.asarray(parts[-j], dtype=np.float64)
        noise = _noise(details) if unit_size is None else unit_size
        threshold = noise * heursure(details / noise) if noise > 0.0 else 0.0
        if threshold > 0.0:  # pywt divides by the size of a detail: one that is zero would come out as no number
            parts[-j] = pywt.threshold(details, threshold, "soft")
        zero = float(np.mean(np.abs(details) <= threshold))
        done.append(Level(j, 2.0 ** (j - 1) * cell_s, 2.0**j * cell_s, len(details), noise, threshold, zero))
    kept = np.asarray(pywt.waverec(parts, wavelet, mode=EDGES), dtype=np.float64)[: len(cells)] + mean
    edge = (length - 1) * (2**levels - 1) * cell_s
    return WaveletSplit(kept, cells - kept, tuple(done), wavelet, rule, edge)


def most_levels(cells: int, wavelet: str = "sym8") -> int:
    """Return the greatest number of levels into which a series of `cells` cells can be split; 0: it is too short for
    any.
    """
    return int(pywt.dwt_max_level(cells, _filter_length(wavelet)))


def heursure(details: Array) -> float:
    """Return the dimensionless threshold of details (n,) of unit noise."""
    n = len(details)
    if n < 2:
        return 0.0
    universal = sqrt(2.0 * log(n))
    squares = np.sort(details**2)
    if (float(np.sum(squares)) - n) / n < log2(n) ** 1.5 / sqrt(n):
        return universal
    first = np.arange(1, n + 1)
    risk = n - 2.0 * first + np.cumsum(squares) + (n - first) * squares
    return min(universal, sqrt(float(squares[int(np.argmin(risk))])))


def _noise(details: Array) -> float:
    return float(np.median(np.abs(details))) / _NORMAL_MAD


def _checked(cells: Array, cell_s: float, rule: Rule, unit_size: float | None, wavelet: str, levels: int) -> int:
    """Check the arguments; return the length of the wavelet's filter."""
    if not 0.0 < cell_s < float("inf"):
        raise BadParameter("cell_s", cell_s, "finite and above 0 s")
    if rule not in ("thesis", "rescaled"):
        raise BadParameter("rule", rule, 'one of "thesis", "rescaled"')
    if (rule == "thesis") != (unit_size is not None):
        raise BadParameter("unit_size", unit_size, 'needed by the rule "thesis", and only by it')
    if unit_size is not None and not 0.0 < unit_size < float("inf"):
        raise BadParameter("unit_size", unit_size, "finite and above 0")
    length = _filter_length(wavelet)
    if cells.ndim != 1 or not np.all(np.isfinite(cells)):
        raise UnfitRecording("a wavelet split takes one series of finite values")
    most = most_levels(cells.size, wavelet)
    if not 1 <= levels <= most:
        raise BadParameter("levels", levels, f"1 to {most}, for {cells.size} cells and {wavelet}")
    return length


def _filter_length(wavelet: str) -> int:
    """Filter length of an orthogonal wavelet of pywt, by its name."""
    named = re.fullmatch(r"(haar)|(db|sym|coif)([1-9]\d?)", wavelet)
    if named is not None and named[1]:
        return 2
    if named is not None:
        order = int(named[3])
        first, last, length = {"db": (1, 38, 2), "sym": (2, 20, 2), "coif": (1, 17, 6)}[named[2]]
        if first <= order <= last:
            return length * order
    raise BadParameter("wavelet", wavelet, "an orthogonal one: haar, db1 to db38, sym2 to sym20, coif1 to coif17")
