"""The Kalman filter of a constant bias (textbook S 5.4.3, example 5.4.3, and 6.2), and the same under coloured noise.

The state is the bias, ``x(k+1) = x(k)``; a measurement is ``z(k) = x + v(k)``. Under white noise of variance R this is
Textbook S 5.180-5.183 with Φ = H = 1, Q = 0: ``K = P/(P + R)``, ``P ← (1 − K)·P``, ``x̂ ← x̂ + K·(z − x̂)``. Under
noise of any covariance C = L·Lᵀ the innovations of the noise are white: ``y = L⁻¹z = L⁻¹1·x + ν`` with unit variance,
and since L is triangular, y(k) needs the measurements up to k alone. Filtering y thus accounts for the whole of C,
without additional states.
"""

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter


class RecursiveBias:
    """Best linear estimate of a constant from successive measurements.

    `covariance` (n, n) of the noise of all measurements that may come; n·R on the diagonal alone is S's filter.
    `prior_variance` None: no prior knowledge; the first measurement is then the first estimate.
    """

    def __init__(self, covariance: Array, prior_mean: float = 0.0, prior_variance: float | None = None) -> None:
        if prior_variance is not None and not prior_variance > 0.0:
            raise BadParameter("prior_variance", prior_variance, "positive, or None where nothing is known")
        self._lower = np.asarray(cholesky(covariance, lower=True), dtype=np.float64)
        ones = np.ones(len(covariance))
        self._sensitivity = np.asarray(solve_triangular(self._lower, ones, lower=True), dtype=np.float64)
        prior = 0.0 if prior_variance is None else 1.0 / prior_variance
        self._information = prior + np.cumsum(self._sensitivity**2)
        self._whitened = np.empty(len(covariance))
        self._normalised: list[float] = []
        self._prior = prior
        self.count = 0
        """Number of measurements so far."""
        self.estimate = prior_mean

    @property
    def variances(self) -> Array:
        """Variance P(k|k) after each of the n measurements, known before the first: textbook S 5.183, shape (n,)."""
        return 1.0 / self._information

    @property
    def gains(self) -> Array:
        """Gains K(k) on the innovation of each measurement, shape (n,): textbook S 5.181 where the noise is white.

        ``x̂(k) = x̂(k−1) + K(k)·(z(k) − ẑ(k))``, with ẑ(k) the measurement expected from all before it.
        """
        return self._sensitivity / self._information / np.diagonal(self._lower)

    @property
    def sd(self) -> float:
        """Current standard uncertainty of the bias; infinite before anything is known."""
        if self.count:
            return float(1.0 / np.sqrt(self._information[self.count - 1]))
        return float(1.0 / np.sqrt(self._prior)) if self._prior > 0.0 else float("inf")

    @property
    def innovations(self) -> Array:
        """Innovations so far over their predicted standard deviations, unit normal where the noise is as declared.

        The first, which without a prior makes the estimate, is left out then.
        """
        return np.array(self._normalised)

    def update(self, measurement: float) -> float:
        """Take the next measurement and return the new estimate. Raises `BadParameter` beyond the measurements whose
        noise was declared.
        """
        k = self.count
        if k == len(self._lower):
            raise BadParameter("measurements", k + 1, f"at most the {k} whose noise was declared")
        row = self._lower[k]
        self._whitened[k] = (measurement - row[:k] @ self._whitened[:k]) / row[k]
        h = self._sensitivity[k]
        innovation = self._whitened[k] - h * self.estimate
        before = self._information[k] - h**2
        if before > 0.0:
            self._normalised.append(float(innovation / np.sqrt(1.0 + h**2 / before)))
        self.estimate += float(h / self._information[k] * innovation)
        self.count = k + 1
        return self.estimate

    def enough_at(self, target_sd: float) -> int | None:
        """Return the number of measurements that suffices for a standard uncertainty, known before the first; None
        where all n are too few.
        """
        reached = np.flatnonzero(self.variances <= target_sd**2)
        return int(reached[0]) + 1 if reached.size else None


def white_covariance(variance: float, count: int) -> Array:
    """Return the covariance of white noise: R on the diagonal, shape (n, n)."""
    return variance * np.eye(count)
