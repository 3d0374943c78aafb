"""Mean temperature of each gyro over recordings, as its correction for temperature goes by."""

from collections.abc import Sequence

import numpy as np

from procedures.analysis.cells import cell_means
from procedures.analysis.thermal.profile_progress import SENSORS
from procedures.core.arrays import Array
from procedures.core.recording import Recording
from procedures.core.temperature.gyros import GyroThermalCorrection

GYRO_SENSORS = SENSORS[2:]
"""Channels of the gyros' own thermometers, x, y, z."""


def gyro_temperatures(recordings: Sequence[Recording], correction: GyroThermalCorrection) -> Array:
    """Temperatures (n, 3) [°C] of n recordings, by the correction's calibration of the sensors where it has one.

    Raises `MissingChannel`, `UnfitRecording`.
    """
    known = correction.thermometers
    rows: list[list[float]] = []
    for recording in recordings:
        read = cell_means(recording, GYRO_SENSORS, recording.info.duration_s).rates[:, 0].tolist()
        if known is not None:
            pairs = zip(GYRO_SENSORS, read, strict=True)
            read = [float(known.corrected(n, t)) if known.has(n) else t for n, t in pairs]
        rows.append(read)
    return np.array(rows)
