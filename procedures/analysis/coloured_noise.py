"""Noise of one long record of cell means, decorrelated by a cosine transform. Independent of any transient.

A discrete cosine transform (type II, orthonormal) decorrelates a rate random walk and a white noise exactly, a flicker
noise and a quantization noise nearly: the coefficients are all but uncorrelated. So the likelihood of a record is that
of its coefficients' squares (Whittle's), with the *exact* variance of each, and division by its root whitens any curve
that is fitted. The mean (k = 0) holds no information on noise and is left out.

The power of each process in a coefficient is that of `noise_fit.columns`; flicker noise is taken as 1/f throughout.
"""

from dataclasses import dataclass
from math import inf

import numpy as np
from scipy.fft import dct
from scipy.optimize import nnls

from procedures.analysis.noise_fit.columns import cosine_powers, covariances
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.noise import NoiseCoefficients

MOST = 2048
"""Most cells of a series; a longer one is averaged in groups."""
FEWEST = 64
"""Fewest cells that distinguish noise from a transient."""
WHOLE_BAND = (0.0, inf)
_SINGLE, _PER_E_FOLD = 24, 8
_TOLERANCE = 1e-6


@dataclass(frozen=True)
class CosineSeries:
    """A series of cell means with its cosine coefficients and their variances per unit of each noise process."""

    values: Array
    """Means over the grouped cells, (n,) [rate]; cells at the end that fill no group are left out."""
    cell_s: float
    """Length of a grouped cell [s]."""
    coefficients: Array
    """Orthonormal cosine coefficients k = 1…n−1, (n−1,) [rate]."""
    unit_variances: Array
    """Variances of the coefficients per unit Q², N², B² and K², (4, n−1)."""

    @property
    def edges_s(self) -> Array:
        """Edges of the cells from the first one's beginning, (n+1,) [s]."""
        return np.arange(len(self.values) + 1, dtype=np.float64) * self.cell_s


def cosine_series(cells: Array, cell_s: float, most: int = MOST) -> CosineSeries:
    """Return cell means (n,) [rate] of length `cell_s` [s], grouped to at most `most`, with their cosine coefficients.
    Raises `BadParameter` and `UnfitRecording`.
    """
    if not 0.0 < cell_s < float("inf"):
        raise BadParameter("cell_s", cell_s, "finite and above 0 s")
    if cells.ndim != 1 or len(cells) < FEWEST:
        raise UnfitRecording(
            f"{cells.size} cells are too few to separate a transient from noise; the least is {FEWEST}"
        )
    if not np.all(np.isfinite(cells)):
        raise UnfitRecording(f"cell {int(np.argmin(np.isfinite(cells)))} is not finite: a transient cannot be sought")
    if np.ptp(cells) == 0.0:
        raise UnfitRecording(
            "the means of all cells are equal: the channel is constant, or repeats a pattern that each cell averages "
            "out"
        )
    group = -(-len(cells) // most)
    values = cells[: len(cells) // group * group].reshape(-1, group).mean(axis=1)
    length = group * cell_s
    return CosineSeries(values, length, cosines(values), unit_variances(len(values), length))


def cosines(values: Array) -> Array:
    """Return the orthonormal cosine coefficients k = 1…n−1 of columns (n,) or (n, m), in the unit of the values."""
    return np.asarray(dct(values, type=2, norm="ortho", axis=0), dtype=np.float64)[1:]


def unit_variances(n: int, cell_s: float) -> Array:
    """Return the variances of the cosine coefficients of n cells per unit Q², N², B² and K², (4, n−1)."""
    return cosine_powers(covariances(n, cell_s, WHOLE_BAND))


@dataclass(frozen=True)
class FittedNoise:
    """Noise fitted by maximum likelihood: its coefficients, the variances of the cosine coefficients under it, and the
    deviance.
    """

    noise: NoiseCoefficients
    variances: Array
    """Variances of the cosine coefficients k = 1…n−1, (n−1,) [rate²]."""
    deviance: float
    """Minus twice the log likelihood, up to a constant of the record."""

    @property
    def weights(self) -> Array:
        """Whitening factors of the cosine coefficients, (n−1,) [1/rate]."""
        return 1.0 / np.sqrt(self.variances)


def fit_noise(coefficients: Array, units: Array) -> FittedNoise:
    """Maximum-likelihood Q, N, B and K, none negative, of cosine coefficients (n−1,) with `unit_variances` (4, n−1).

    Minimize ``Σ ln s_k + c_k²/s_k`` over ``s = Σ θ_j·u_jk`` by Fisher scoring, each step a non-negative least squares
    with weights 1/s². Neighbouring coefficients of high k, where s is smooth, are taken together.
    """
    starts = _bins(len(coefficients))
    counts = np.diff(np.append(starts, len(coefficients))).astype(np.float64)
    power = np.add.reduceat(coefficients**2, starts) / counts
    shares = np.add.reduceat(units, starts, axis=1) / counts
    theta = np.mean(power) / np.mean(shares, axis=1) / len(units)
    for _ in range(30):  # each step raises the likelihood; a rough start for the scoring
        s = theta @ shares
        theta = theta * np.sqrt((shares @ (counts * power / s**2)) / (shares @ (counts / s)))
    best, least = theta, _deviance(counts, power, theta @ shares)
    for _ in range(40):
        weight = np.sqrt(counts) / (best @ shares)
        size = np.linalg.norm(shares * weight, axis=1)
        step = nnls((shares * weight).T / size, weight * power)[0] / size - best
        length, deviance = 1.0, np.inf
        while length > 1e-3:
            deviance = _deviance(counts, power, (best + length * step) @ shares)
            if deviance <= least:
                break
            length *= 0.5
        if deviance >= least - _TOLERANCE:
            break
        best, least = best + length * step, deviance
    q, n, b, k = np.sqrt(best).tolist()
    noise = NoiseCoefficients(quantization=q, random_walk=n, bias_instability=b, rate_random_walk=k)
    return FittedNoise(noise, best @ units, least)


def _deviance(counts: Array, power: Array, s: Array) -> float:
    if np.any(s <= 0.0):
        return np.inf
    return float(np.dot(counts, np.log(s) + power / s))


def _bins(count: int) -> list[int]:
    """First index of each bin: singly at first, then evenly in the logarithm."""
    if count <= _SINGLE:
        return list(range(count))
    number = max(2, int(np.log(count / _SINGLE) * _PER_E_FOLD))
    later = np.round(np.geomspace(_SINGLE, count, number, endpoint=False)).astype(int)
    return sorted({*range(_SINGLE), *later.tolist()})
