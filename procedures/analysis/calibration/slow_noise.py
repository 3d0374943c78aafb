"""Slow noise seen within the poses: what the scatter of short averages leaves out of a pose mean's uncertainty.

κ is how far the Allan variance at a quarter of a pose exceeds what white noise would leave there, as part of a mean's
variance. It counts `SLOW` times, for between poses a slow process has more time than within one: over a set of poses
flicker varies by two to three times its Allan variance.
"""

import numpy as np

from procedures.core.arrays import Array

SLOW = 3.0
GROUPS = 4
"""Number of parts of a pose from the means of which slow noise is estimated."""


def slow_excess(batch_means: Array) -> Array:
    """Excess variance of a pose's mean due to slow noise, by channel, from batch means (batches, channels).

    ``σ²_A(T/4) − σ²_A(T/batches)·4/batches``: zero on average for white noise, so it may come out negative; it is to be
    averaged over the poses before it is cut at zero.
    """
    batches = len(batch_means) - len(batch_means) % GROUPS
    groups = batch_means[:batches].reshape(GROUPS, -1, batch_means.shape[1]).mean(axis=1)
    fine = 0.5 * np.mean(np.diff(batch_means[:batches], axis=0) ** 2, axis=0)
    coarse = 0.5 * np.mean(np.diff(groups, axis=0) ** 2, axis=0)
    return np.asarray(coarse - fine * GROUPS / batches, dtype=np.float64)


def slow_share(excess: Array, noise_covariance: Array) -> float:
    """Return κ of the channel with the most slow noise: `excess` (n, 3) of the poses, `noise_covariance` (3, n, n)."""
    white = np.mean(np.diagonal(noise_covariance, axis1=1, axis2=2), axis=1)
    return float(np.max(SLOW * np.maximum(excess.mean(axis=0), 0.0) / white))
