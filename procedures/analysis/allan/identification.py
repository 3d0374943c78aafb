"""Which power law rules at a cluster size, by lag-1 autocorrelation (Riley and Greenhall 2004; NIST SP 1065, 5.5.6).

The spectral density of the rate is taken as ∝ f^α: α = 2 white and 1 flicker angle noise, 0 white (random walk of the
angle), −1 flicker (bias instability), −2 random walk of the rate, −3 and −4 its flicker and integrated walk.
"""

import numpy as np

from procedures.analysis.allan.integral import Piece
from procedures.analysis.allan.statistic import Sizes
from procedures.core.arrays import Array

FEWEST = 30
"""Below so many points the method decides nothing."""
SURE = 120
"""With so many points a rounded exponent rarely errs."""
MOST = 4096
"""More points than these do not change a rounded exponent."""
_HELD = 1 << 17
_LATE = 1 << 16


def lag1_exponent(x: Array, most_differences: int) -> float:
    """α, not rounded, from values of the running sum one cluster apart, (n,).

    A quadratic (offset and ramp of the rate) is removed; x is differenced until ``δ = r₁/(1 + r₁) < 1/4``, r₁ the
    lag-1 autocorrelation; then ``α = 2 − 2(δ + d)``, d the number of differences.
    """
    t = np.linspace(-1.0, 1.0, len(x))
    z = x - np.mean(x)
    for shape in (t, t**2 - np.mean(t**2)):  # orthogonal to one another and to a constant
        z = z - shape * (np.dot(shape, z) / np.dot(shape, shape))
    for d in range(most_differences + 1):
        z = z - np.mean(z)
        power = float(np.dot(z, z))
        r1 = float(np.dot(z[1:], z[:-1])) / power if power > 0.0 else -0.5
        delta = r1 / (1.0 + r1)
        if delta < 0.25 or d == most_differences:
            return 2.0 - 2.0 * (delta + d)
        z = np.diff(z)
    raise AssertionError("the loop returns")


class LatePoints:
    """Keeps what the identification needs of a long running sum: every s-th value, and all of the last ones."""

    def __init__(self, count: int) -> None:
        self._stride = max(1, count // _HELD)
        self._points = np.zeros(count // self._stride + 1)
        self._late = np.zeros(1)
        self._index = 1

    def add(self, piece: Piece) -> None:
        """The next piece of the running sum."""
        first = -self._index % self._stride
        kept = piece.x[first :: self._stride]
        at = (self._index + first) // self._stride
        self._points[at : at + len(kept)] = kept
        self._late = np.concatenate([self._late[-_LATE:], piece.x])[-_LATE:]
        self._index += len(piece.x)

    def exponents(self, sizes: Sizes, order: int) -> Array:
        """α rounded at each size (k,), for a statistic's order, −2 (Allan) or −4 (Hadamard) to 2.

        Where fewer than `FEWEST` points are left, that of the smaller size. Taking every m-th point folds flicker angle
        noise into what looks white, and few points scatter, so α does not rise where it is known better already: from
        flicker to white angle noise, or with fewer than `SURE` points at all.
        """
        alpha = np.zeros(len(sizes))
        before: float | None = None
        for i, size in enumerate(sizes):
            m = int(size)
            points, step = (self._late, m) if m < self._stride else (self._points, m // self._stride)
            x = points[::-step][:MOST][::-1]
            if len(x) >= FEWEST:
                found = float(np.clip(np.round(lag1_exponent(x, order)), -2.0 if order == 2 else -4.0, 2.0))
                if before is not None and (before == 1.0 or len(x) < SURE):
                    found = min(found, before)
                before = found
            alpha[i] = before or 0.0
        return alpha
