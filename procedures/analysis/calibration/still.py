"""Detection of the poses in which a hand-turned unit stood still, in a recording without labels.

After Tedaldi, Pretto and Menegatti (ICRA 2014, imu_tk): the variance in a moving window against that of a stretch at
the beginning which is known to be still.
"""

from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.slow_noise import GROUPS, slow_excess
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording


@dataclass(frozen=True)
class StillSettings:
    """Criteria for a still pose: largest motion and least duration."""

    initial_s: float = 20.0
    """The unit is known to rest for this long at the beginning."""
    window_s: float = 1.0
    """Length of the moving window, centred."""
    factor: float = 10.0
    """The threshold, as a multiple of the initial variance."""
    shortest_s: float = 1.0
    """Shorter stretches are no pose."""
    margin_s: float = 0.25
    """Cut from both ends of every stretch: the hand has hardly let go."""


@dataclass(frozen=True)
class Stretch:
    """Samples [start, stop) of a recording that stood still."""

    start: int
    stop: int


def still_stretches(samples: Array, rate_hz: float, settings: StillSettings | None = None) -> tuple[Stretch, ...]:
    """Stretches of (n, 3) samples during which the unit rested, in order.

    Still is where ``√Σ_c var_c² ≤ factor·√Σ_c var_c²(initial)``, the variances over the moving window. Raises
    `UnfitRecording` where the recording is shorter than its still beginning, `BadParameter` where that is shorter than
    two windows. A stretch of a single sample is none: it shows no scatter.
    """
    s = settings or StillSettings()
    width = max(2, round(s.window_s * rate_hz))
    initial = round(s.initial_s * rate_hz)
    if initial < 2 or len(samples) < initial + width:
        raise UnfitRecording(
            f"{len(samples) / rate_hz:.4g} s are too short for a still beginning of {s.initial_s:g} s and one window"
        )
    if initial < 2 * width:
        allowed = f"at least {2 * width / rate_hz:g} s, two windows of still.window_s"
        raise BadParameter("still.initial_s", s.initial_s, allowed)
    variance = np.linalg.norm(moving_variance(samples, width), axis=1)
    threshold = s.factor * float(np.median(variance[width // 2 : initial - width // 2]))
    still = np.concatenate([[False], variance <= threshold, [False]])
    edges = np.flatnonzero(still[1:] != still[:-1]).reshape(-1, 2)
    margin = round(s.margin_s * rate_hz)
    cut = [Stretch(int(a) + margin, int(b) - margin) for a, b in edges]
    return tuple(c for c in cut if c.stop - c.start >= max(2.0, s.shortest_s * rate_hz))


def require_poses(recording_id: str, stretches: tuple[Stretch, ...], fewest: int, settings: StillSettings) -> None:
    """Refuse fewer still stretches than a calibration needs, with how long to hold a pose. Raises `UnfitRecording`."""
    if len(stretches) >= fewest:
        return
    s, found = settings, f"{len(stretches)} still stretch{'es' if len(stretches) != 1 else ''}"
    raise UnfitRecording(
        f"recording {recording_id}: {found} found, at least {fewest} different poses are needed: hold each for "
        f"{s.shortest_s + s.window_s + 2.0 * s.margin_s:g} s (still.shortest_s + still.window_s + 2·still.margin_s), "
        "or make those shorter, and turn farther between; where a hand trembles, a greater still.factor than "
        f"{s.factor:g} finds more"
    )


def moving_variance(samples: Array, width: int) -> Array:
    """Return the sample variance in a centred window of `width` samples, shape of `samples`; at the ends of what is
    there.
    """
    centred = samples - samples.mean(axis=0)
    n = len(samples)
    sums = np.vstack([np.zeros(samples.shape[1]), np.cumsum(centred, axis=0)])
    squares = np.vstack([np.zeros(samples.shape[1]), np.cumsum(centred**2, axis=0)])
    low = np.maximum(np.arange(n) - width // 2, 0)
    high = np.minimum(np.arange(n) - width // 2 + width, n)
    count = (high - low)[:, None]
    mean = (sums[high] - sums[low]) / count
    return np.maximum((squares[high] - squares[low]) / count - mean**2, 0.0) * count / np.maximum(count - 1, 1)


def pose_means(samples: Array, stretches: tuple[Stretch, ...], batches: int = 10) -> tuple[Array, Array]:
    """Mean of every stretch and its standard uncertainty, both (poses, 3).

    The uncertainty is the scatter of the means of `batches` equal parts of the stretch, over √batches: it allows for
    noise correlated over less than a part, and for a hand that creeps. A stretch of fewer samples has a part for each.
    """
    means, sds = [], []
    for stretch in stretches:
        pose = samples[stretch.start : stretch.stop]
        count = min(batches, len(pose))
        parts = np.array([part.mean(axis=0) for part in np.array_split(pose, count)])
        means.append(pose.mean(axis=0))
        sds.append(parts.std(axis=0, ddof=1) / np.sqrt(count))
    return np.array(means).reshape(-1, 3), np.array(sds).reshape(-1, 3)


def pose_excess(samples: Array, stretches: tuple[Stretch, ...], batches: int = 12) -> Array:
    """Return the excess variance of every stretch's mean due to slow noise (`slow_excess`), shape (poses, 3);
    zero of a stretch too short to show it.
    """
    excess = []
    for stretch in stretches:
        pose = samples[stretch.start : stretch.stop]
        parts = np.array_split(pose, min(batches, len(pose)))
        means = np.array([part.mean(axis=0) for part in parts])
        excess.append(slow_excess(means) if len(means) >= GROUPS else np.zeros(samples.shape[1]))
    return np.array(excess).reshape(-1, 3)
