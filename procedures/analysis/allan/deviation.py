"""An Allan deviation with its uncertainty, from an array or from blocks of any length. No files, no randomness."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.allan.confidence_intervals import ONE_SIGMA, degrees_of_freedom, interval
from procedures.analysis.allan.correlated import CorrelatedSums, Uncorrelatable
from procedures.analysis.allan.differences import NonOverlappingSums
from procedures.analysis.allan.identification import exponents
from procedures.analysis.allan.integral import Gaps, Integral
from procedures.analysis.allan.overlapping import WHOLE, OverlappingSums
from procedures.analysis.allan.statistic import OVERLAPPING_ALLAN, Sizes, Statistic, checked_sizes
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording

Sums = CorrelatedSums | OverlappingSums | NonOverlappingSums


@dataclass(frozen=True)
class Deviation:
    """σ(τ) of one channel; arrays (k,), ascending in τ, in the unit of the rate (time deviation: rate·s)."""

    statistic: Statistic
    rate_hz: float
    count: int
    sizes: Sizes
    """Cluster sizes m in samples."""
    tau_s: Array
    deviation: Array
    terms: NDArray[np.int64]
    """Number of squared differences that were averaged."""
    left_out: NDArray[np.int64]
    """Number of terms omitted because they touch a gap."""
    strides: NDArray[np.int64]
    """Samples between neighbouring terms; 1 is exact, more: see `correlated` and `overlapping`."""
    alpha: Array
    """Exponent of the rate's spectral density that the edf assume."""
    edf: Array
    lower: Array
    upper: Array
    confidence: float
    missing: int
    """Number of samples that were NaN."""
    first_missing: int | None


class DeviationStream:
    """One channel's deviation from blocks, in bounded memory (10 MB for 10⁷ samples, 25 MB for 10⁸).

    Samples are rates, or with ``increments=True`` increments of the integrated output, which are multiplied by
    `rate_hz`. A NaN is refused, or with ``gaps="aware"`` the terms that touch it are left out and counted. `count` is
    the number of samples that will come. Raises `UnfitRecording` and `BadParameter`.
    """

    def __init__(
        self,
        rate_hz: float,
        count: int,
        statistic: Statistic = OVERLAPPING_ALLAN,
        *,
        sizes: Sequence[int] | Sizes | None = None,
        increments: bool = False,
        gaps: Gaps = "refuse",
        confidence: float = ONE_SIGMA,
        correlate: bool = True,
    ) -> None:
        self._rate_hz, self._count, self._statistic, self._confidence = rate_hz, count, statistic, confidence
        wanted = checked_sizes(sizes, count, statistic)
        interval(np.ones(1), np.ones(1), confidence)
        self._integral = Integral(rate_hz, increments=increments, gaps=gaps)
        self._sums: Sums
        if not statistic.overlapping:
            self._sums = NonOverlappingSums(statistic, count, wanted)
        elif count <= WHOLE or gaps != "refuse" or not correlate:
            self._sums = OverlappingSums(statistic, count, wanted)
        else:
            self._sums = CorrelatedSums(statistic, count, wanted)

    def add(self, block: Array | NDArray[np.int32]) -> None:
        """Add the next samples of the channel, (n,). Raises `UnfitRecording` for more than were announced."""
        if self._integral.count + len(block) > self._count:
            raise UnfitRecording(f"more samples came than the {self._count} that were announced")
        if isinstance(self._sums, CorrelatedSums):
            for rates in self._integral.rates(block):
                self._sums.add(rates)
        else:
            for piece in self._integral.add(block):
                self._sums.add(piece)

    def finish(self) -> Deviation:
        """Return the deviation. Call once, after the last sample; cluster sizes without a single term (gaps) do not
        appear.
        """
        self._integral.check_end(self._count)
        return from_sums(self._statistic, self._rate_hz, self._count, self._sums, self._integral, self._confidence)


def from_sums(
    statistic: Statistic, rate_hz: float, count: int, of: Sums, integral: Integral, confidence: float
) -> Deviation:
    """Return the deviation from sums that all samples, and their `integral`, have gone through. Raises `UnfitRecording`
    where no term was left.
    """
    sums, terms = of.finish()
    if isinstance(of, CorrelatedSums):
        sums = sums * integral.scale**2
    all_starts = of.starts()
    there = terms > 0
    if not np.any(there):
        raise UnfitRecording(
            f"no cluster is whole: {integral.missing} of {count} samples are missing, the first at "
            f"{integral.first_missing}"
        )
    sizes, terms, starts = of.sizes[there], terms[there], all_starts[there]
    variance = statistic.variance(sums[there], terms.astype(np.float64), sizes, rate_hz)
    alpha = exponents(of.held(), sizes, statistic.order)
    kinds = zip(alpha, sizes, strict=True)
    edf = np.array([degrees_of_freedom(statistic, int(a), int(m), count) for a, m in kinds]) * terms / starts
    deviation = np.sqrt(variance)
    lower, upper = interval(deviation, edf, confidence)
    return Deviation(
        statistic=statistic,
        rate_hz=rate_hz,
        count=count,
        sizes=sizes,
        tau_s=sizes / rate_hz,
        deviation=deviation,
        terms=terms,
        left_out=starts - terms,
        strides=of.strides[there],
        alpha=alpha,
        edf=edf,
        lower=lower,
        upper=upper,
        confidence=confidence,
        missing=integral.missing,
        first_missing=integral.first_missing,
    )


def deviation(
    samples: Array | NDArray[np.int32],
    rate_hz: float,
    statistic: Statistic = OVERLAPPING_ALLAN,
    *,
    sizes: Sequence[int] | Sizes | None = None,
    increments: bool = False,
    gaps: Gaps = "refuse",
    confidence: float = ONE_SIGMA,
) -> Deviation:
    """The deviation of one channel held in memory, (n,); see `DeviationStream`.

    Where the fast sums would lose accuracy (`correlated.Uncorrelatable`: more than a hundred-thousandth by rounding, a
    two-thousandth by periodic signals), it is differenced term by term.

    `sizes`: cluster sizes [samples]; None: the thesis's, evenly in their logarithm. `increments` and
    errors as in `DeviationStream`.
    """
    for correlate in (True, False):
        stream = DeviationStream(
            rate_hz,
            len(samples),
            statistic,
            sizes=sizes,
            increments=increments,
            gaps=gaps,
            confidence=confidence,
            correlate=correlate,
        )
        try:
            stream.add(samples)
            return stream.finish()
        except Uncorrelatable:
            continue
    raise AssertionError("term by term, no rounding is too large")
