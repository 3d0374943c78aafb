"""Allan deviation and its relatives of one channel that is held in memory."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.allan.deviation import Deviation, deviation
from procedures.analysis.allan.family import deviations
from procedures.analysis.allan.statistic import STATISTICS, Sizes, Statistic, log_sizes
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.library.arguments import Samples, one_of, positive, series
from procedures.library.figure import axes


@dataclass(frozen=True)
class Curve:
    """σ(τ) with its interval; arrays (k,), ascending in τ, in the unit of the samples (time deviation: unit·s)."""

    statistic: str
    rate_hz: float
    confidence: float
    tau_s: Array
    deviation: Array
    lower: Array
    upper: Array
    edf: Array
    """Equivalent degrees of freedom."""
    terms: NDArray[np.int64]
    """Squared differences that were averaged."""

    def plot(self, ax: Any = None, label: str | None = None) -> Any:
        """Draw the curve and its interval on logarithmic axes; returns the axes (`.figure.savefig(...)`). `ax` None:
        new axes; `label`: name of the curve in a legend.
        """
        ax = axes(ax)
        (line,) = ax.loglog(self.tau_s, self.deviation, label=label or self.statistic.replace("_", " "))
        ax.fill_between(self.tau_s, self.lower, self.upper, color=line.get_color(), alpha=0.2, linewidth=0.0)
        ax.set_xlabel("τ, s")
        ax.set_ylabel("σ(τ), unit of the samples")
        ax.grid(visible=True, which="both", alpha=0.3)
        return ax


def allan(
    y: Samples,
    rate_hz: float,
    statistic: str = "overlapping_allan",
    *,
    increments: bool = False,
    points: int = 200,
    confidence: float = 0.6827,
    gaps: str = "refuse",
) -> Curve:
    """Deviation of a record, with intervals from equivalent degrees of freedom (NIST SP 1065, 5).

    Parameters
    ----------
    y : (n,) rates, or with `increments` increments a sample. rate_hz : samples a second [Hz].
    statistic : allan, overlapping_allan, modified_allan, time, hadamard, overlapping_hadamard.
    points : cluster times, evenly spaced in their logarithm. confidence : of the intervals, between 0 and 1.
    gaps : "refuse" NaN, or "leave_out" every difference that touches one.

    Raises `BadParameter`, `UnfitRecording`.
    """
    samples, rate = series("y", y), positive("rate_hz", rate_hz)
    kind = STATISTICS[one_of("statistic", statistic, tuple(STATISTICS))]
    handling = one_of("gaps", gaps, ("refuse", "leave_out"))
    found = deviation(
        samples,
        rate,
        kind,
        sizes=_sizes(kind, samples, points, confidence),
        increments=increments,
        gaps="refuse" if handling == "refuse" else "aware",
        confidence=confidence,
    )
    return _curve(found)


def allan_family(
    y: Samples,
    rate_hz: float,
    statistics: Sequence[str] = tuple(STATISTICS),
    *,
    increments: bool = False,
    points: int = 200,
    confidence: float = 0.6827,
) -> dict[str, Curve]:
    """Deviations of a record by several statistics in one pass, by name: cheaper than one after the other.

    Parameters as of `allan`; a NaN is refused. Raises `BadParameter`, `UnfitRecording`.
    """
    samples, rate = series("y", y), positive("rate_hz", rate_hz)
    kinds = [STATISTICS[one_of("statistics", name, tuple(STATISTICS))] for name in statistics]
    sizes = {kind: _sizes(kind, samples, points, confidence) for kind in kinds}
    found = deviations(samples, rate, sizes, increments=increments, confidence=confidence)
    return {kind.name: _curve(one) for kind, one in found.items()}


def _sizes(kind: Statistic, samples: Array, points: int, confidence: float) -> Sizes:
    if not 0.0 < confidence < 1.0:
        raise BadParameter("confidence", confidence, "between 0 and 1")
    if not 2 <= points <= 10_000:
        raise BadParameter("points", points, "2 … 10000")
    largest = kind.largest(len(samples))
    if largest < 1:
        raise BadParameter("y", f"{len(samples)} samples", f"more samples: {kind.name} has no term of so few")
    return log_sizes(largest, points)


def _curve(found: Deviation) -> Curve:
    return Curve(
        found.statistic.name,
        found.rate_hz,
        found.confidence,
        found.tau_s,
        found.deviation,
        found.lower,
        found.upper,
        found.edf,
        found.terms,
    )
