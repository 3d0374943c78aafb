"""Power spectral density of a channel at rest, from the bins that the likelihood fit uses."""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from procedures.analysis.noise_fit.powers import Powers


@dataclass(frozen=True)
class Density:
    """One-sided power spectral density ``S(f) = 2·P(f)·Δt`` [rate²/Hz]; all lists run parallel to `frequency_hz`.

    P is the mean power of a bin's modes and Δt the sampling period, so white noise of N [rate·√s] has 2N². Slow bins
    come from the cells of the whole record, fast ones from its segments; lines that were taken out are not in it.
    """

    frequency_hz: tuple[float, ...]
    density: tuple[float, ...]
    lower: tuple[float, ...]
    """Lower end of the interval at the requested confidence, by chi-square of each bin's degrees of freedom."""
    upper: tuple[float, ...]
    """Upper end of the interval at the requested confidence, by chi-square of each bin's degrees of freedom."""


def density_of(slow: Powers, fast: Powers | None, confidence: float) -> Density:
    """Return the density over all bins: of the cells beneath the lowest fast bin, of the segments from there on. `fast`
    None: there are no segments.
    """
    parts = [slow] if fast is None or not len(fast.frequency_hz) else [slow, fast]
    first = np.inf if len(parts) == 1 else float(parts[1].frequency_hz[0])
    kept = [slow.frequency_hz < first, *(np.ones(len(p.frequency_hz), dtype=np.bool_) for p in parts[1:])]
    frequency = np.concatenate([p.frequency_hz[k] for p, k in zip(parts, kept, strict=True)])
    density = np.concatenate([2.0 * p.period_s * p.power[k] for p, k in zip(parts, kept, strict=True)])
    dof = np.concatenate([p.dof[k] for p, k in zip(parts, kept, strict=True)])
    tail = 0.5 * (1.0 - confidence)
    lower, upper = density * dof / chdtri(dof, tail), density * dof / chdtri(dof, 1.0 - tail)
    return Density(*(tuple(v.tolist()) for v in (frequency, density, lower, upper)))
