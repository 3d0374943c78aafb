"""Means of a triad over poses at rest, with what is known of their noise: from recordings, stretches or rows."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from procedures.analysis.calibration.slow_noise import slow_share
from procedures.analysis.calibration.station_means import station_means
from procedures.analysis.calibration.station_noise import outputs_covariance
from procedures.analysis.calibration.still import StillSettings, pose_excess, pose_means, still_stretches
from procedures.analysis.calibration.triad_analysis import noise_of_means, scatter_covariance
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.recording import TRIADS, Recording, rates, require_finite
from procedures.core.unit import TriadRecord

_SMALLEST_SD = 1e-9
"""Noise of pose means about which nothing is known, as a part of the largest reading; the residuals scale it."""


class NoiseSource(Enum):
    """Origin of the noise of pose means."""

    RECORD = "the unit's record, or a standard deviation that was given"
    SCATTER = "the scatter of the samples within the poses"
    NOTHING = "nothing but the residuals of the fit"


@dataclass(frozen=True)
class Poses:
    """Means of the poses and what is known of their noise."""

    outputs: Array
    """Shape (n, 3), in `output_unit`."""
    noise: Array
    """Covariance by channel, (3, n, n)."""
    noise_source: NoiseSource
    output_unit: str
    labels: tuple[str, ...]
    slow: float = 0.0
    """Share of slow noise κ, where the noise comes from the scatter (`slow_noise`)."""

    @property
    def noise_known(self) -> bool:
        """Whether the noise does not come from the data."""
        return self.noise_source is NoiseSource.RECORD


def poses_of_recordings(recordings: Sequence[Recording], triad: str, record: TriadRecord | None) -> Poses:
    """One pose a recording. Raises `UnfitRecording`."""
    means = station_means(recordings, triad)
    noise, known = noise_of_means(means, record)
    labels = tuple(f"pose {i} ({label})" for i, label in enumerate(means.labels, start=1))
    if known:
        return Poses(means.outputs, noise, NoiseSource.RECORD, means.output_unit, labels)
    slow = slow_share(means.slow_excess, noise)
    return Poses(means.outputs, noise, NoiseSource.SCATTER, means.output_unit, labels, slow)


def poses_of_stretches(recording: Recording, triad: str, record: TriadRecord | None, settings: StillSettings) -> Poses:
    """The still stretches of one recording of a unit that was turned by hand. Raises `UnfitRecording`."""
    info, samples, output_unit = recording.info, *_samples(recording, triad)
    stretches = still_stretches(samples, info.rate_hz, settings)
    if not stretches:
        raise UnfitRecording(f"recording {info.id}: no still stretch was found")
    outputs, sd = pose_means(samples, stretches)
    windows = np.array([[p.start, p.stop] for p in stretches]) / info.rate_hz + info.start_s
    labels = tuple(f"pose {i} ({a:.4g} to {b:.4g} s)" for i, (a, b) in enumerate(windows.tolist(), start=1))
    known = outputs_covariance(record, output_unit, windows)
    if known is not None:
        return Poses(outputs, known, NoiseSource.RECORD, output_unit, labels)
    noise = scatter_covariance(outputs, np.maximum(sd, np.median(sd, axis=0)))
    slow = slow_share(pose_excess(samples, stretches), noise)
    return Poses(outputs, noise, NoiseSource.SCATTER, output_unit, labels, slow)


def poses_of_rows(recording: Recording, triad: str, record: TriadRecord | None, pose_sd: float | None) -> Poses:
    """Each row as the mean over one pose, which lasts a sample period. Raises `UnfitRecording`.

    The noise is `pose_sd` [output unit] where it is given, else the unit's record over each row's time, else nothing
    is known of it.
    """
    info, samples, output_unit = recording.info, *_samples(recording, triad)
    rows = len(samples)
    labels = tuple(f"row {i}" for i in range(1, rows + 1))
    if pose_sd is not None:
        return Poses(samples, _equal_noise(pose_sd, rows), NoiseSource.RECORD, output_unit, labels)
    windows = (np.arange(rows)[:, None] + np.array([0.0, 1.0])) / info.rate_hz + info.start_s
    known = outputs_covariance(record, output_unit, windows)
    if known is not None:
        return Poses(samples, known, NoiseSource.RECORD, output_unit, labels)
    least = _SMALLEST_SD * float(np.max(np.abs(samples)))
    return Poses(samples, _equal_noise(least, rows), NoiseSource.NOTHING, output_unit, labels)


def _samples(recording: Recording, triad: str) -> tuple[Array, str]:
    """Rates of a triad, (n, 3), and their unit. Raises `UnfitRecording` for samples that are not finite."""
    info, names = recording.info, TRIADS[triad]
    samples = rates(recording, names)
    require_finite(info, names, samples)
    return samples, info.channels[info.column(names[0])].rate_unit


def _equal_noise(sd: float, rows: int) -> Array:
    return np.broadcast_to(sd**2 * np.eye(rows), (3, rows, rows))
