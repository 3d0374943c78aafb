"""Means of a channel over successive windows, and the covariance of their noise.

The noise of such means is not white. Quantization correlates neighbours: both share the reading at their common edge,
with opposite signs. Flicker and rate random walk correlate all of them.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import toeplitz

from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.calibration.station_plan import dwell_for
from procedures.analysis.cells import cell_means
from procedures.analysis.least_squares.chi_square import tail_probability
from procedures.analysis.least_squares.whitening import whitener
from procedures.analysis.noise_fit.estimate import Estimate
from procedures.analysis.noise_fit.likelihood import fit_noise
from procedures.analysis.noise_fit.powers import slow_powers
from procedures.analysis.recursive_bias.kalman import RecursiveBias
from procedures.core.arrays import Array
from procedures.core.errors import DomainError, MissingChannel, UnfitRecording
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import Recording

WINDOWS_MAX = 300
"""Most windows of a recording: their covariance is a full matrix."""
WINDOWS_MIN = 20
BATCHES = 10


@dataclass(frozen=True)
class WindowMeans:
    """Mean nominal rates over even windows of one recording."""

    length_s: float
    means: Array
    """Shape (n, channels), in each channel's rate unit."""
    windows: Array
    """[start, stop] in bench time [s], shape (n, 2)."""


def window_means(recording: Recording, names: tuple[str, ...], window_s: float) -> WindowMeans:
    """Mean rates over windows, block by block; windows are lengthened to be at most `WINDOWS_MAX`, the rest is dropped.

    Raises `MissingChannel`, and `UnfitRecording` where there are fewer than `WINDOWS_MIN` windows, samples that are not
    numbers, or another number of samples than announced.
    """
    info = recording.info
    size = max(1, round(window_s * info.rate_hz), -(-info.count // WINDOWS_MAX))
    count = info.count // size
    if count < WINDOWS_MIN:
        raise UnfitRecording(
            f"recording {info.id}: {info.duration_s:g} s give {count} windows of {size / info.rate_hz:g} s, "
            f"at least {WINDOWS_MIN} are needed"
        )
    length = size / info.rate_hz
    means = cell_means(recording, names, length).rates.T
    edges_s = np.linspace(info.start_s, info.start_s + length * count, count + 1)
    windows = np.column_stack([edges_s[:-1], edges_s[1:]])
    return WindowMeans(length, means, windows)


def contiguous_covariance(noise: NoiseCoefficients, windows: Array) -> Array:
    """Covariance (n, n) [rate²] of the means over windows (n, 2), from a channel's coefficients.

    `station_noise` gives all but the quantization of neighbours: a reading of the integrated output errs by Q, a mean
    over T by the difference of two readings, so ``2Q²/T²`` on the diagonal and, where two windows touch, ``−Q²/T²``
    next to it.
    """
    covariance = mean_covariance(noise, windows)
    lengths = windows[:, 1] - windows[:, 0]
    touch = np.flatnonzero(np.isclose(windows[1:, 0], windows[:-1, 1], rtol=0.0, atol=1e-6 * lengths.min()))
    shared = -(noise.quantization**2) / (lengths[touch] * lengths[touch + 1])
    covariance[touch, touch + 1] += shared
    covariance[touch + 1, touch] += shared
    return covariance


def observed_covariance(means: Array) -> Array:
    """Covariance (n, n) from the means (n,) themselves, for a channel of unknown noise.

    Variance and covariance of neighbours, nothing farther (a moving average of order one): white noise and
    quantization. Its correlation lies within ±1/2 by definition, and an estimate outside is clipped to that range.
    Raises `UnfitRecording` for a constant channel.
    """
    centred = means - means.mean()
    variance = float(centred @ centred) / (len(means) - 1)
    if variance == 0.0:
        raise UnfitRecording("the channel is constant: its noise cannot be found from it")
    neighbours = float(centred[1:] @ centred[:-1]) / (len(means) - 1)
    correlation = min(max(neighbours / variance, -0.499), 0.499)
    column = np.zeros(len(means))
    column[:2] = variance, correlation * variance
    return np.asarray(toeplitz(column), dtype=np.float64)


def spectral_covariance(means: Array, length_s: float) -> Array:
    """Covariance (n, n) from the noise fitted to the spectrum of the means (n,) over windows of `length_s`.

    Quantization, random walk and flicker of `fit_noise`; each coefficient counts with its standard uncertainty added,
    since the bias depends on a random walk that quantization nearly hides. An unobserved random walk counts with half
    of its upper limit: nothing else keeps the uncertainty from falling without bound. A rate random walk or a ramp is
    left out: with them there is no constant bias, and `slow_noise_p` reveals it. Where the spectrum cannot be fitted
    the result is `observed_covariance`. Raises `UnfitRecording` for a constant channel.
    """
    observed = observed_covariance(means)
    try:
        fit = fit_noise(slow_powers(means, length_s))
    except DomainError:
        return observed
    walk = _with_uncertainty(fit.random_walk) or 0.5 * fit.random_walk.upper_limit
    if not np.isfinite(walk):
        return observed
    noise = NoiseCoefficients(
        _with_uncertainty(fit.quantization), walk, _with_uncertainty(fit.bias_instability), 0.0, 0.0
    )
    edges = length_s * np.arange(len(means) + 1, dtype=np.float64)
    return contiguous_covariance(noise, np.column_stack([edges[:-1], edges[1:]]).astype(np.float64))


def _with_uncertainty(estimate: Estimate) -> float:
    """Sum of value and standard uncertainty; zero where the process was not observed."""
    return 0.0 if estimate.value is None else estimate.value + (estimate.standard_uncertainty or 0.0)


def slow_noise_p(means: Array, covariance: Array) -> float:
    """Probability that `BATCHES` equal parts of the means (n,) scatter this much under the given covariance.

    ``χ² = rᵀV⁻¹r`` of the parts about their weighted mean, V their covariance, with one degree of freedom fewer than
    parts; noise slower than declared makes it large.
    """
    parts = np.array_split(np.arange(len(means)), BATCHES)
    averaging = np.zeros((BATCHES, len(means)))
    for row, part in zip(averaging, parts, strict=True):
        row[part] = 1.0 / len(part)
    weights = whitener(averaging @ covariance @ averaging.T)
    values, ones = weights @ averaging @ means, weights @ np.ones(BATCHES)
    residuals = values - ones * float(ones @ values) / float(ones @ ones)
    return tail_probability(float(residuals @ residuals), BATCHES - 1)


def predicted_sd(noise: NoiseCoefficients, dwell_s: float, start_s: float, prior_variance: float | None) -> float:
    """Return the standard uncertainty of a bias after a dwell, in a hundred windows of it. `prior_variance` of the
    bias, None: nothing is known before.
    """
    edges = start_s + np.linspace(0.0, dwell_s, 101)
    covariance = contiguous_covariance(noise, np.column_stack([edges[:-1], edges[1:]]))
    return float(np.sqrt(RecursiveBias(covariance, 0.0, prior_variance).variances[-1]))


def dwell_needed(
    noise: NoiseCoefficients, target_sd: float, start_s: float, prior_variance: float | None, shortest_s: float
) -> float | None:
    """Return the shortest dwell [s], `shortest_s` at least, for the required uncertainty of a bias; None where none
    suffices.
    """
    return dwell_for(lambda dwell: predicted_sd(noise, dwell, start_s, prior_variance), target_sd, shortest_s)


def known_noise(noise: NoiseCoefficients | None) -> NoiseCoefficients | None:
    """Return the coefficients if at least one of the short-time processes is present, else None."""
    if noise is None or not (noise.quantization > 0.0 or noise.random_walk > 0.0 or noise.bias_instability > 0.0):
        return None
    return noise


def channel_names(recording: Recording, wanted: tuple[str, ...] | None, all_of: tuple[str, ...]) -> tuple[str, ...]:
    """Return the `wanted` channels, or where None those of `all_of` that the recording has. Raises `MissingChannel`."""
    present = tuple(c.name for c in recording.info.channels)
    names = wanted or tuple(name for name in all_of if name in present)
    if not names:
        raise MissingChannel(all_of[0], present)
    return names
