"""The dominant power law at a cluster size, by lag-1 autocorrelation (Riley and Greenhall 2004; NIST SP 1065, 5.5.6).

The spectral density of the rate is taken as ∝ f^α: α = 2 white and 1 flicker angle noise, 0 white (random walk of the
angle), −1 flicker (bias instability), −2 random walk of the rate, −3 and −4 its flicker and integrated walk.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from procedures.analysis.allan.integral import Piece
from procedures.analysis.allan.statistic import Sizes
from procedures.core.arrays import Array

FEWEST = 30
"""Fewest points for which the method decides anything."""
SURE = 120
"""Number of points from which on a rounded exponent is rarely wrong."""
MOST = 2048
"""Most points used; more do not change a rounded exponent."""
_HELD = 1 << 17
_LATE = 1 << 16


def lag1_exponent(x: Array, most_differences: int) -> float:
    """The exponent α, not rounded, from values of the running sum one cluster apart, (n,).

    A quadratic (offset and ramp of the rate) is removed; x is differenced until ``δ = r₁/(1 + r₁) < 1/4``, r₁ the
    lag-1 autocorrelation; then ``α = 2 − 2(δ + d)``, d the number of differences.
    """
    shapes = _quadratics(len(x))
    z = x - x[0]
    z -= (shapes @ z) @ shapes
    for d in range(most_differences + 1):
        z = z - np.mean(z)
        power = float(np.dot(z, z))
        r1 = float(np.dot(z[1:], z[:-1])) / power if power > 0.0 else -0.5
        delta = r1 / (1.0 + r1)
        if delta < 0.25 or d == most_differences:
            return 2.0 - 2.0 * (delta + d)
        z = np.diff(z)
    raise AssertionError("the loop returns")


@lru_cache(maxsize=256)
def _quadratics(count: int) -> Array:
    """An orthonormal basis of the quadratics on evenly spaced points, (3, count)."""
    t = np.linspace(-1.0, 1.0, count)
    shapes = np.stack([np.ones(count), t, t**2 - np.mean(t**2)])
    return shapes / np.linalg.norm(shapes, axis=1, keepdims=True)


@dataclass(frozen=True)
class Held:
    """Values of a running sum that the identification needs: every s-th from the first on, and all of the last ones."""

    points: Array
    """The running sum at every `stride`-th sample, (n,)."""
    stride: int
    late: Array
    """The running sum at each of the last samples."""


class LatePoints:
    """Collects the values of a running sum that the identification needs: every s-th, and all of the last ones."""

    def __init__(self, count: int) -> None:
        self._stride = max(1, count // _HELD)
        self._points = np.zeros(count // self._stride + 1)
        self._late = np.zeros(min(count + 1, _LATE))
        self._index, self._skipped = 1, count + 1 - len(self._late)

    def add(self, piece: Piece) -> None:
        """Add the next piece of the running sum."""
        first = -self._index % self._stride
        kept = piece.x[first :: self._stride]
        at = (self._index + first) // self._stride
        self._points[at : at + len(kept)] = kept
        self._index += len(piece.x)
        end = self._index - self._skipped
        if end > 0:
            kept = piece.x[-end:]
            self._late[end - len(kept) : end] = kept

    def held(self) -> Held:
        """Return the kept values. Call after the last piece."""
        return Held(self._points, self._stride, self._late)


def exponents(held: Held, sizes: Sizes, order: int) -> Array:
    """The rounded exponent α at each size (k,), for a statistic's order, −2 (Allan) or −4 (Hadamard) to 2.

    With fewer than `FEWEST` points, α of the smaller size is used. Taking every m-th point aliases flicker angle noise
    into apparent white noise, and few points scatter, so α does not rise where a smaller size determines it better:
    from flicker to white angle noise, or with fewer than `SURE` points at all.
    """
    alpha = np.zeros(len(sizes))
    before: float | None = None
    last_step = 0
    for i, size in enumerate(sizes):
        m = int(size)
        values, step = (held.late, m) if m < held.stride else (held.points, m // held.stride)
        if i and step == last_step and m >= held.stride:
            alpha[i] = alpha[i - 1]  # of the same points
            continue
        last_step = step if m >= held.stride else 0
        x = values[::-step][:MOST][::-1]
        if len(x) >= FEWEST:
            found = float(np.clip(np.round(lag1_exponent(x, order)), -2.0 if order == 2 else -4.0, 2.0))
            if before is not None and (before == 1.0 or len(x) < SURE):
                found = min(found, before)
            before = found
        alpha[i] = before or 0.0
    return alpha
