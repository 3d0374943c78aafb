"""Reduction of a thermal run's recording, block by block, to second means and the profile's evidence.

Twelve hours at 100 samples/s of thirteen channels become 43 200 rows; what is kept does not grow with the sample rate.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from procedures.analysis.cells import CellStream, channel_rows
from procedures.analysis.thermal.profile_progress import (
    AIR,
    CASE,
    CONVERTER,
    DISCONNECTED_CODE,
    SENSORS,
    SET_POINT,
    CheckedSamples,
    LegEvidence,
    ProfileProgress,
    Standing,
)
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.recording import ACCELEROMETER, AXES, GYRO, RawArray, Recording, RecordingInfo
from procedures.core.temperature_profile import TemperatureProfile

CHANNELS = (*GYRO, *ACCELEROMETER, *SENSORS, AIR, SET_POINT)
SECOND_S = 1.0
RATE_UNITS = {**dict.fromkeys(GYRO, "rad/s"), **dict.fromkeys(ACCELEROMETER, "m/s^2")}


@dataclass(frozen=True)
class CycleSeries:
    """Recorded series of one run, a row a second."""

    label: str
    up: int
    """Index of the axis that stands upwards, 0 … 2."""
    sample_s: float
    since_launch_s: float
    gyro_rad_s: Array
    """Gyro rates [rad/s], shape (n, 3)."""
    output_m_s2: Array
    """Nominal accelerometer outputs, (n, 3)."""
    sensors_c: Array
    """The unit's temperature sensors in the order of `SENSORS`, (n, 5)."""
    air_c: Array
    """Chamber's air temperature, as it reports it, (n,)."""
    set_point_c: Array
    legs: tuple[LegEvidence, ...]
    """Evidence of each leg of the profile, judged again from the recording."""

    @property
    def case_c(self) -> Array:
        return self.sensors_c[:, SENSORS.index(CASE)]

    @property
    def converter_c(self) -> Array:
        return self.sensors_c[:, SENSORS.index(CONVERTER)]

    @property
    def name(self) -> str:
        """Display name of the run for tables, as "x up"."""
        return f"{AXES[self.up]} up"

    @property
    def t_s(self) -> Array:
        """Middles of the rows since the recording's beginning, (n,)."""
        return (np.arange(len(self.air_c), dtype=np.float64) + 0.5) * self.sample_s


def read_cycle(recording: Recording, up: int) -> CycleSeries:
    """Return the means over each second of a run's channels; `up` is the index of the axis that stood upwards.

    Raises `MissingChannel`, `UnfitRecording` naming what is wrong: no profile, a profile that was not gone through, a
    sensor that is not there, channels in counts.
    """
    info = recording.info
    station = info.station
    if station is None or station.profile is None:
        raise UnfitRecording(f"recording {info.id} is not a run of a thermal cycle: its station has no profile")
    columns = {name: info.column(name) for name in CHANNELS}
    for name, wanted in RATE_UNITS.items():
        if (found := info.channels[columns[name]].rate_unit) != wanted:
            raise UnfitRecording(f"recording {info.id}: {name} is in {found}, a thermal cycle needs it in {wanted}")
    stream = CellStream(info, CHANNELS, SECOND_S)
    replay = _Replay(info, station.profile)
    for rows in channel_rows(info, CHANNELS, replay.watched(recording.blocks())):
        stream.add(rows)
    cells = stream.finish()
    if replay.progress.leg is not None:
        done, legs = len(replay.progress.evidence), len(station.profile.legs)
        raise UnfitRecording(f"recording {info.id} ends after {done} of {legs} legs of its profile")
    rates = cells.rates.T
    return CycleSeries(
        station.label,
        up,
        cells.cell_s,
        cells.since_launch_s,
        rates[:, 0:3],
        rates[:, 3:6],
        rates[:, 6:11],
        rates[:, 11],
        rates[:, 12],
        tuple(replay.progress.evidence),
    )


def run_of(run: tuple[Recording, int]) -> tuple[str, CycleSeries]:
    """Return the recording's id, and `read_cycle` of recording and axis."""
    return run[0].info.id, read_cycle(*run)


class _Replay:
    """Feeds the recorded readings to the profile's judge, as the bench did."""

    def __init__(self, info: RecordingInfo, profile: TemperatureProfile) -> None:
        self.progress = ProfileProgress(profile)
        self._id = info.id
        self._columns = [info.column(name) for name in (*SENSORS, AIR)]
        self._channels = [info.channels[c] for c in self._columns]
        self._checked = CheckedSamples(info.rate_hz)

    def watched(self, blocks: Iterator[RawArray]) -> Iterator[RawArray]:
        """The blocks as they are, judged in passing."""
        for block in blocks:
            self._require_connected(block)
            for row, t_s in self._checked.of_block(len(block)):
                if self.progress.leg is not None:
                    self._judge(block[row], t_s)
            yield block

    def _judge(self, row: RawArray, t_s: float) -> None:
        codes = row[self._columns].tolist()
        readings = [c.value(code) for c, code in zip(self._channels, codes, strict=True)]
        case, converter = readings[SENSORS.index(CASE)], readings[SENSORS.index(CONVERTER)]
        if self.progress.step(t_s, case, converter, readings[-1]) is Standing.LATE:
            raise UnfitRecording(f"recording {self._id}: {self.progress.why_late(readings[-1])}")

    def _require_connected(self, block: RawArray) -> None:
        for name, column in zip(SENSORS, self._columns, strict=False):
            if np.any(block[:, column] == DISCONNECTED_CODE):
                raise UnfitRecording(f"recording {self._id}: {name} was disconnected")
