"""Bias and Allan deviation of a dwell from the part of it that is recorded so far."""

from dataclasses import dataclass

import numpy as np

from procedures.analysis.allan.deviation import deviation
from procedures.analysis.recursive_bias.kalman import RecursiveBias
from procedures.analysis.recursive_bias.window_noise import contiguous_covariance, known_noise, observed_covariance
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.noise import NoiseCoefficients

WINDOWS = 200
"""Most windows of the filter: their covariance is a full matrix."""
WINDOWS_MIN = 20
TRACE = 60
"""Most points of the filter's course that are given."""
ALLAN_MIN = 16
"""Fewest cells for an Allan deviation."""


@dataclass(frozen=True)
class BiasSoFar:
    """Kalman estimate of a channel's constant output over the dwell so far, in the channel's rate unit."""

    estimate: float
    standard_uncertainty: float
    at_s: Array
    """Time since the first sample of each point of the course [s], shape (m,)."""
    course: Array
    """Estimate after each of these, shape (m,)."""
    course_uncertainty: Array
    innovations_rms: float
    """Root mean square of the normalised innovations: about 1 where the noise is as it was taken."""
    noise_known: bool
    """True where the noise is the unit's; False: taken from the dwell itself, white or with correlated neighbours."""


@dataclass(frozen=True)
class AllanSoFar:
    """Overlapping Allan deviation of a channel so far, with its one-sigma interval; all shape (k,)."""

    tau_s: Array
    deviation: Array
    lower: Array
    upper: Array


def bias_so_far(means: Array, cell_s: float, noise: NoiseCoefficients | None) -> BiasSoFar:
    """Run the Kalman filter of a constant bias over the means (n,) of successive cells of `cell_s`.

    The noise's covariance is the unit's where its coefficients are known (`contiguous_covariance`), else, with `noise`
    None, the dwell's own (`observed_covariance`). Raises `UnfitRecording` for fewer than `WINDOWS_MIN` cells and for a
    constant channel.
    """
    windows, length_s = _windows(means, cell_s)
    known = known_noise(noise)
    if known is not None:
        edges = np.linspace(0.0, length_s * len(windows), len(windows) + 1)
        covariance = contiguous_covariance(known, np.column_stack([edges[:-1], edges[1:]]))
    else:
        covariance = observed_covariance(windows)
    bias = RecursiveBias(covariance)
    course = np.array([bias.update(float(mean)) for mean in windows])
    chosen = np.unique(np.linspace(0, len(windows) - 1, min(TRACE, len(windows))).round().astype(int))
    innovations = bias.innovations
    return BiasSoFar(
        estimate=bias.estimate,
        standard_uncertainty=bias.sd,
        at_s=length_s * (chosen + 1.0),
        course=course[chosen],
        course_uncertainty=np.sqrt(bias.variances[chosen]),
        innovations_rms=float(np.sqrt(np.mean(innovations**2))),
        noise_known=known is not None,
    )


def allan_so_far(means: Array, cell_s: float) -> AllanSoFar:
    """Allan deviation from the means (n,) of successive cells: that of the samples at the multiples of `cell_s`.

    Raises `UnfitRecording` for fewer than `ALLAN_MIN` cells.
    """
    if len(means) < ALLAN_MIN:
        raise UnfitRecording(f"{len(means)} cells of {cell_s:g} s: an Allan deviation needs {ALLAN_MIN}")
    found = deviation(means, 1.0 / cell_s)
    return AllanSoFar(found.tau_s, found.deviation, found.lower, found.upper)


def _windows(means: Array, cell_s: float) -> tuple[Array, float]:
    """Join cells to at most `WINDOWS` even windows; the rest is left out."""
    size = -(-len(means) // WINDOWS)
    count = len(means) // max(1, size)
    if count < WINDOWS_MIN:
        raise UnfitRecording(f"{len(means)} cells of {cell_s:g} s: the filter needs {WINDOWS_MIN}")
    return means[: count * size].reshape(count, size).mean(axis=1), cell_s * size
