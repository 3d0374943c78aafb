"""Several statistics of one channel in one pass: what their sums have in common is accumulated once."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.allan.confidence_intervals import ONE_SIGMA, interval
from procedures.analysis.allan.correlated import CorrelatedSums, SharedProducts, Uncorrelatable
from procedures.analysis.allan.deviation import Deviation, deviation, from_sums
from procedures.analysis.allan.differences import NonOverlappingSums
from procedures.analysis.allan.integral import Integral
from procedures.analysis.allan.overlapping import WHOLE
from procedures.analysis.allan.statistic import MODIFIED_ALLAN, TIME, Sizes, Statistic, checked_sizes
from procedures.core.arrays import Array


def deviations(
    samples: Array | NDArray[np.int32],
    rate_hz: float,
    sizes: Mapping[Statistic, Sizes],
    *,
    increments: bool = False,
    confidence: float = ONE_SIGMA,
) -> dict[Statistic, Deviation]:
    """The deviations of one channel held in memory, (n,), without gaps, at the cluster sizes of each statistic.

    Each is what `deviation.deviation` finds: exact sizes to rounding; the larger ones of a long series, whose claim is
    0.1 %, to some 10⁻⁵, as the windows of the longest member serve all. The time deviation is the modified one times
    τ/√3, and is not summed for itself. A statistic for which the fast sums would lose accuracy is differenced alone,
    term by term. Raises `UnfitRecording` and `BadParameter`. `increments` as in `DeviationStream`.
    """
    count = len(samples)
    wanted = {statistic: checked_sizes(own, count, statistic) for statistic, own in sizes.items()}
    interval(np.ones(1), np.ones(1), confidence)
    summed = {s: own for s, own in wanted.items() if s != TIME or not _is_scaled(wanted)}
    if count <= WHOLE:
        alone = partial(deviation, samples, rate_hz, increments=increments, confidence=confidence)
        found = {statistic: alone(statistic, sizes=own) for statistic, own in summed.items()}
    else:
        found = _together(samples, rate_hz, summed, increments, confidence)
    if TIME in wanted and TIME not in found:
        found[TIME] = _time(found[MODIFIED_ALLAN])
    return {statistic: found[statistic] for statistic in sizes}


def _is_scaled(wanted: Mapping[Statistic, Sizes]) -> bool:
    return MODIFIED_ALLAN in wanted and np.array_equal(wanted[TIME], wanted[MODIFIED_ALLAN])


def _time(modified: Deviation) -> Deviation:
    factor = modified.tau_s / np.sqrt(3.0)
    values = {name: getattr(modified, name) * factor for name in ("deviation", "lower", "upper")}
    return replace(modified, statistic=TIME, **values)


def _together(
    samples: Array | NDArray[np.int32],
    rate_hz: float,
    wanted: Mapping[Statistic, Sizes],
    increments: bool,
    confidence: float,
) -> dict[Statistic, Deviation]:
    count = len(samples)
    shared = SharedProducts(count, max((s.differences for s in wanted if s.overlapping), default=1))
    sums = {
        s: CorrelatedSums(s, count, own, shared) if s.overlapping else NonOverlappingSums(s, count, own)
        for s, own in wanted.items()
    }
    integral = Integral(rate_hz, increments=increments)
    apart = [one for one in sums.values() if isinstance(one, NonOverlappingSums)]
    for rates, piece in integral.rates_and_sums(samples):
        if len(apart) < len(sums):
            shared.add(rates)
        for one in apart:
            one.add(piece)
    integral.check_end(count)
    found: dict[Statistic, Deviation] = {}
    for statistic, one in sums.items():
        try:
            found[statistic] = from_sums(statistic, rate_hz, count, one, integral, confidence)
        except Uncorrelatable:
            found[statistic] = deviation(
                samples,
                rate_hz,
                statistic,
                sizes=wanted[statistic],
                increments=increments,
                confidence=confidence,
            )
    return found
