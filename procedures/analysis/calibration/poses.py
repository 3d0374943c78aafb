"""The poses of a scalar calibration with their noise as far as known: stations, or rows that are means already."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.scalar import PARAMETERS
from procedures.analysis.calibration.slow_noise import slow_share
from procedures.analysis.calibration.station_means import station_means
from procedures.analysis.calibration.station_noise import outputs_covariance
from procedures.analysis.calibration.triad_analysis import noise_of_means
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.recording import TRIADS, Recording
from procedures.core.unit import Unit

_SMALLEST_SD = 1e-9
"""Noise assumed for pose means of unknown noise, relative to the largest reading, before scaling to the residuals."""


@dataclass(frozen=True)
class Poses:
    """Means of the poses with their noise as far as known."""

    outputs: Array
    """Shape (n, 3), in `output_unit`."""
    noise: Array
    """Covariance by channel, (3, n, n)."""
    known: bool
    """True if the noise comes from the unit's record."""
    slow: float
    """Share of slow noise, of noise that is not known."""
    output_unit: str
    labels: tuple[str, ...]
    scatters: bool = True
    """False where the poses are single rows: then nothing of their noise is in the data."""


def station_poses(recordings: Sequence[Recording], triad: str, unit: Unit | None) -> Poses:
    """Return the poses of stations, one recording a pose, with the noise of the unit's record; without one, that of the
    scatter. Raises `UnfitRecording`, `MissingChannel`.
    """
    means = station_means(recordings, triad)
    noise, known = noise_of_means(means, unit.triad(triad) if unit else None)
    slow = 0.0 if known else slow_share(means.slow_excess, noise)
    labels = tuple(f"pose {i} ({label})" for i, label in enumerate(means.labels, start=1))
    return Poses(means.outputs, noise, known, slow, means.output_unit, labels)


def rows_as_poses(recording: Recording, samples: Array, triad: str, pose_sd: float | None, unit: Unit | None) -> Poses:
    """Poses from rows (n, 3) that are means already; a row lasts as long as its sample period.

    The noise is `pose_sd`, the standard deviation of a row where it is given, else the unit's record over each row's
    time, else what the residuals show, for which more poses are needed than the nine that the parameters take. Raises
    `BadParameter`.
    """
    info, rows = recording.info, len(samples)
    output_unit = info.channels[info.column(TRIADS[triad][0])].rate_unit
    labels = tuple(f"row {i}" for i in range(1, rows + 1))
    if pose_sd is not None:
        given = np.broadcast_to(pose_sd**2 * np.eye(rows), (3, rows, rows))
        return Poses(samples, given, True, 0.0, output_unit, labels)
    windows = (np.arange(rows)[:, None] + np.array([0.0, 1.0])) / info.rate_hz + info.start_s
    known = outputs_covariance(unit.triad(triad) if unit else None, output_unit, windows)
    if known is not None:
        return Poses(samples, known, True, 0.0, output_unit, labels)
    if rows <= len(PARAMETERS):
        allowed = f"needed with {rows} pose means of unknown noise: {len(PARAMETERS)} parameters leave nothing to check"
        raise BadParameter("pose_sd", None, allowed)
    least = (_SMALLEST_SD * float(np.max(np.abs(samples)))) ** 2
    noise = np.broadcast_to(least * np.eye(rows), (3, rows, rows))
    return Poses(samples, noise, False, 0.0, output_unit, labels, scatters=False)
