"""Channels of a recording that hold the encoder's readings beside the unit's samples, and the readings taken out again.

Each sample has the newest reading of the three axes at the end of its interval, how old it was then, and half the
interval in which it was taken. A reading stands beside several samples where the table is read less often. All axes
count: where two of them are parallel, the one that swings shakes the other, and the unit feels the sum.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.recording import Channel, Quantity, Recording

ANGLE_STEP_DEG = 1e-6
TIME_STEP_S = 1e-7
ANGLES = ("table_outer", "table_middle", "table_inner")
AGE, WITHIN = "table_reading_age", "table_reading_within"
ENCODER_CHANNELS = (
    *(Channel(name, Quantity.TABLE_ANGLE, "rad", ANGLE_STEP_DEG * units.DEG) for name in ANGLES),
    Channel(AGE, Quantity.TIME, "s", TIME_STEP_S),
    Channel(WITHIN, Quantity.TIME, "s", TIME_STEP_S),
)
NO_READING = -1
"""Age, in counts, of a sample before the first reading."""
LEAST_READINGS = 30


@dataclass(frozen=True)
class Readings:
    """Readings of the encoders, as the angle about one axis of the unit."""

    time_s: Array
    """Time from the recording's beginning, by the bench's clock [s], (n,)."""
    angle_rad: Array
    within_s: float
    """Mean of half the intervals in which the readings were taken [s]."""


@dataclass(frozen=True)
class Samples:
    """Samples of one gyro channel over a recording, with the encoder readings about its axis."""

    label: str
    rate_hz: float
    time_s: Array
    """Middle of each sample's interval, by the recording's stamps, from its beginning [s], (n,)."""
    rate_rad_s: Array
    """Nominal rate of each sample [rad/s], (n,)."""
    integrates: bool
    """True where a sample is the mean over its interval; False: how it was made is the unit's own affair."""
    encoder: Readings


def samples_of(recording: Recording, channel: str, directions: Sequence[float]) -> Samples:
    """A gyro channel and the encoders' readings of a recording, one pass over it.

    `directions`: component of the table's outer, middle and inner axis along the channel's: small motions add up.

    Raises `MissingChannel`, and `UnfitRecording` where the channel has no nominal scale or the readings are too few.
    """
    info = recording.info
    names = (channel, *ANGLES, AGE, WITHIN)
    columns = [info.column(name) for name in names]
    raw = np.concatenate([np.asarray(block)[:, columns] for block in recording.blocks()]).astype(np.float64)
    gyro = info.channels[columns[0]]
    if gyro.rate_unit != "rad/s":
        raise UnfitRecording(f"{channel} is in {gyro.rate_unit}: a response needs a nominal scale in rad")
    label = info.id if info.station is None else info.station.label
    encoder = _readings(raw[:, 1:], info.rate_hz, directions)
    if len(encoder.time_s) < LEAST_READINGS:
        raise UnfitRecording(
            f"station {label}: {len(encoder.time_s)} readings of the encoder where at least {LEAST_READINGS} are needed"
        )
    rates = info.nominal_scale([channel]).rates(raw[:, :1])[:, 0]
    middles: Array = (np.arange(len(raw), dtype=np.float64) + 0.5) / info.rate_hz
    integrates = gyro.quantity is Quantity.ANGLE_INCREMENT
    return Samples(label, info.rate_hz, middles, rates, integrates, encoder)


def _readings(raw: Array, rate_hz: float, directions: Sequence[float]) -> Readings:
    """Readings from the columns of the angles, age and within, each once."""
    ends: Array = np.arange(1, len(raw) + 1, dtype=np.float64) / rate_hz
    known = raw[:, -2] > NO_READING
    times: Array = (ends - TIME_STEP_S * raw[:, -2])[known]
    angle = ANGLE_STEP_DEG * units.DEG * (raw[known, :3] - raw[known, :3][:1]) @ np.array(directions)
    # A reading that stands beside several samples has one time, but for the rounding of its age.
    fresh = np.diff(times, prepend=-np.inf) > 2.0 * TIME_STEP_S
    within = float(np.mean(TIME_STEP_S * raw[known, -1][fresh])) if np.any(fresh) else 0.0
    return Readings(times[fresh], angle[fresh], within)
