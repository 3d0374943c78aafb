"""Expected power of a process of unit coefficient in each mode of a spectrum: exact, no approximation by f.

The rate y of a channel is averaged over cells of Δ: ``y_k = (θ_{k+1} − θ_k)/Δ``. With R the rate's autocovariance and
F'' = R, the cell means' is ``γ(l) = (F((l+1)Δ) − 2F(lΔ) + F((l−1)Δ))/Δ²``. Where a variance does not exist (flicker,
random walk) R is a generalised covariance, good up to a constant, which modes of zero sum do not see:

* quantization, white reading errors Q of θ: ``γ = Q²/Δ²·(2, −1, 0…)``;
* random walk ``N²/Δ·(1, 0…)``;
* bias instability ``R(t) = (B²/π)(E₁(t/τ₂) − E₁(t/τ₁))``, one-sided density B²/(π f) between (`core.noise`);
* rate random walk ``R(t) = −K²|t|/2``.

So γ(0) − γ(1) is the Allan variance at Δ: 3Q²/Δ², N²/Δ, (2 ln 2/π)B² (whole band), K²Δ/3 (IEEE Std 952 Annex C).
"""

from functools import lru_cache
from math import isinf, log, pi

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.special import exp1, expn

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter

FlickerBand = tuple[float, float]
QUANTIZATION, RANDOM_WALK, BIAS_INSTABILITY, RATE_RANDOM_WALK = range(4)
"""Order of the columns; each belongs to the square of its coefficient."""
_EXPANDED = 64
"""Lag from which on the second difference of l² ln l is expanded; the direct one loses digits with l²."""


def covariances(count: int, cell_s: float, band_s: FlickerBand) -> Array:
    """Autocovariance γ(l) of cell means at lags l = 0…count−1 for unit Q², N², B², K², (4, count) [per unit of each].

    `band_s` are the shortest and longest relaxation time of the flicker; 0 and infinity are allowed.
    Raises `BadParameter`.
    """
    low, high = band_s
    if not 0.0 <= low < high:
        raise BadParameter("flicker_band_s", band_s, "0 ≤ shortest < longest")
    gamma = np.zeros((4, count))
    lag = np.arange(count, dtype=np.float64)
    gamma[QUANTIZATION, :2] = np.array([2.0, -1.0]) / cell_s**2
    gamma[RANDOM_WALK, 0] = 1.0 / cell_s
    gamma[BIAS_INSTABILITY] = _flicker(lag, low / cell_s, high / cell_s) / pi
    gamma[RATE_RANDOM_WALK] = -0.5 * cell_s * lag
    gamma[RATE_RANDOM_WALK, 0] = -cell_s / 6.0
    return gamma


def _flicker(lag: Array, shortest: float, longest: float) -> Array:
    """Cell means' covariance of a flicker of ``R = E₁(t/τ₂) − E₁(t/τ₁)``, times in cells, up to a constant.

    ``E₁(x) = Ein(x) − ln x − const``; ``F = τ²·E₃(t/τ) + τ·t`` has F'' = E₁(t/τ) and no kink at t = 0.
    """
    result = -0.5 * _second_difference_of_square_log(lag)
    if not isinf(longest):  # smooth over a cell: its value at the lag is its mean
        x = lag[1:] / longest
        result[1:] += exp1(x) + np.log(x) + float(np.euler_gamma)
    if shortest > 0.0:
        e3 = expn(3, np.abs(np.arange(-1.0, len(lag) + 1.0)) / shortest)
        second = e3[2:] - 2.0 * e3[1:-1] + e3[:-2]
        second[0] += 2.0 / shortest
        result -= shortest**2 * second
    return result


def _second_difference_of_square_log(lag: Array) -> Array:
    """Second difference ``(l+1)² ln|l+1| − 2l² ln|l| + (l−1)² ln|l−1|``."""

    def square_log(x: Array) -> Array:
        return x**2 * np.log(np.where(x == 0.0, 1.0, np.abs(x)))

    near = lag[:_EXPANDED]
    far = lag[_EXPANDED:]
    direct = square_log(near + 1.0) - 2.0 * square_log(near) + square_log(near - 1.0)
    expanded = 2.0 * np.log(far) + 3.0 - 1.0 / (6.0 * far**2) - 1.0 / (30.0 * far**4)
    return np.concatenate([direct, expanded])


@lru_cache(maxsize=2)
def of_cells(count: int, cell_s: float, band_s: FlickerBand) -> Array:
    """Return the expected power of unit Q², N², B², K² in the modes of a record's cell means, (4, count − 1).

    The channels of a launch share it: it is read only. Raises `BadParameter`.
    """
    # one process at a time: transforms of all four would be the largest thing in memory
    expected = np.stack([cosine_powers(gamma) for gamma in covariances(count, cell_s, band_s)])
    expected[QUANTIZATION] = free_ended_quantization(count, cell_s)
    expected.setflags(write=False)
    return expected


@lru_cache(maxsize=2)
def of_segments(length: int, edge: int, rate_hz: float, band_s: FlickerBand) -> Array:
    """Return the expected power of unit Q², N², B², K² in the modes of tapered segments, (4, length/2 + 1).

    `edge`: samples over which the taper rises; its squares sum to 1. Read only. Raises `BadParameter`.
    """
    taper = sine_edged_taper(length, edge)
    taper /= np.sqrt(np.sum(taper**2))
    expected = tapered_powers(covariances(length, 1.0 / rate_hz, band_s), taper)
    expected.setflags(write=False)
    return expected


def cosine_powers(gamma: Array) -> Array:
    """``E c_j²`` of the orthonormal cosine transform (DCT-II) of n values of autocovariance γ, j = 1…n−1; (…, n−1).

    From ``c_j = √(2/n) Σ y_k cos(πj(k+½)/n)`` and the sum of products of cosines at one lag:
    ``E c_j² = γ(0) + (2/n) Σ_{l≥1} γ(l)·((n−l) cos(πjl/n) − sin(πjl/n)/sin(πj/n))``. A constant in γ drops out.
    """
    n = gamma.shape[-1]
    lag = np.arange(n)
    inner = np.where(lag > 0, gamma, 0.0)
    even: NDArray[np.complex128] = np.asarray(fft.rfft(inner * (n - lag), 2 * n, axis=-1))
    odd: NDArray[np.complex128] = np.asarray(fft.rfft(inner, 2 * n, axis=-1))
    cosine, sine = even.real[..., 1:n], -odd.imag[..., 1:n]
    return gamma[..., :1] + (2.0 / n) * (cosine - sine / np.sin(pi * np.arange(1, n) / n))


def free_ended_quantization(count: int, cell_s: float) -> Array:
    """``4 sin²(πj/2n)/Δ²``, j = 1…n−1: E c_j² of unit Q once the first and the last reading are free, (n−1,).

    Those two are the same in all modes; without them the modes of the rest are independent (a sine transform).
    """
    return 4.0 * np.sin(0.5 * pi * np.arange(1, count) / count) ** 2 / cell_s**2


def sine_edged_taper(count: int, edge: int) -> Array:
    """Return weights (count,) that rise as a sine over `edge` and fall likewise; squares of overlapped neighbours add
    to 1.
    """
    rise = np.sin(0.5 * pi * (np.arange(edge) + 0.5) / edge)
    return np.concatenate([rise, np.ones(count - 2 * edge), rise[::-1]])


def tapered_powers(gamma: Array, taper: Array) -> Array:
    """``E|X_j|²`` of ``X_j = Σ w_k (y_k − ȳ) e^{−2πi jk/L}``, ``ȳ = Σwy/Σw``, j = 0…L/2; of γ (…, L): (…, L/2+1).

    With ``A_j = Σ w y e``, W the taper's transform: ``E|A_j|² − 2Re(W_j* E(A_j A_0))/W_0 + |W_j|² E A_0²/W_0²``.
    """
    n = len(taper)
    spectrum = np.asarray(fft.rfft(taper, 2 * n))
    overlap = np.asarray(fft.irfft(np.abs(spectrum) ** 2, 2 * n))[:n]
    weighted = gamma * overlap
    weighted[..., 1:] *= 2.0
    alone: NDArray[np.complex128] = np.asarray(fft.rfft(weighted, axis=-1))
    around = np.concatenate([gamma, np.zeros_like(gamma[..., :1]), gamma[..., :0:-1]], axis=-1)
    smeared = np.asarray(fft.irfft(np.asarray(fft.rfft(around, axis=-1)) * spectrum, 2 * n, axis=-1))[..., :n]
    product: NDArray[np.complex128] = np.asarray(fft.rfft(taper * smeared, axis=-1))
    window: NDArray[np.complex128] = np.asarray(fft.rfft(taper)) / float(np.sum(taper))
    total = product[..., :1].real
    return alone.real - 2.0 * (np.conj(window) * product).real + np.abs(window) ** 2 * total


def allan_columns(tau_s: Array) -> Array:
    """Allan variance for unit Q², N², B², K², R²; (k, 5): ``3/τ², 1/τ, 2 ln 2/π, τ/3, τ²/2`` (IEEE Std 952 Annex C)."""
    flat = np.full(len(tau_s), 2.0 * log(2.0) / pi)
    return np.stack([3.0 / tau_s**2, 1.0 / tau_s, flat, tau_s / 3.0, 0.5 * tau_s**2], axis=1)
