"""Raw samples and their meaning: channels, stations, recordings.

A recording keeps what the unit sent, integer counts for a real or simulated one. `scale` and `offset` are the data
sheet's nominal conversion, not the calibration: ``value = scale·(raw − offset)`` in the channel's unit, an increment
divided by the sample period.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from procedures.core.arrays import Array
from procedures.core.errors import MissingChannel, UnfitRecording
from procedures.core.measured import Measured
from procedures.core.sinusoid import Sinusoid
from procedures.core.stop_rule import StopRule
from procedures.core.table_angles import TableAngles
from procedures.core.temperature_profile import TemperatureProfile
from procedures.core.turn import Turn

RawArray = NDArray[np.int32] | NDArray[np.float64]
V = TypeVar("V", float, Array)

AXES = ("x", "y", "z")
GYRO = tuple(f"gyro_{axis}" for axis in AXES)
ACCELEROMETER = tuple(f"accelerometer_{axis}" for axis in AXES)
TRIADS = {"gyro": GYRO, "accelerometer": ACCELEROMETER}


class Quantity(StrEnum):
    """Physical quantity that a channel measures."""

    ANGLE_INCREMENT = "angle_increment"
    VELOCITY_INCREMENT = "velocity_increment"
    ANGULAR_RATE = "angular_rate"
    SPECIFIC_FORCE = "specific_force"
    TEMPERATURE = "temperature"
    """Temperature of a sensor of the unit or of the chamber's air."""
    TABLE_ANGLE = "table_angle"
    """Angle of one axis of the table, by its encoder."""
    TIME = "time"
    """Age of the table's reading at the end of a sample's interval, or half the interval in which it was taken."""


INCREMENTS = (Quantity.ANGLE_INCREMENT, Quantity.VELOCITY_INCREMENT)
UNITS: dict[Quantity, tuple[str, ...]] = {
    Quantity.ANGLE_INCREMENT: ("rad", "count"),
    Quantity.VELOCITY_INCREMENT: ("m/s", "count"),
    Quantity.ANGULAR_RATE: ("rad/s", "count"),
    Quantity.SPECIFIC_FORCE: ("m/s^2", "count"),
    Quantity.TEMPERATURE: ("degC", "count"),
    Quantity.TABLE_ANGLE: ("rad", "count"),
    Quantity.TIME: ("s", "count"),
}
"""Permitted units of a channel of each quantity; "count" marks a scale that is not known yet."""
AROUND = (Quantity.TEMPERATURE, Quantity.TABLE_ANGLE, Quantity.TIME)
"""Quantities of channels that are recorded with the triads and belong to neither: temperatures of unit and chamber,
angles of the table, and the ages of its readings."""


LEAST_SCALE, GREATEST_SCALE = 1e-30, 1e30
"""Bounds of a scale, far beyond any sensor's: with others squares of values overflow, or vanish."""


@dataclass(frozen=True)
class Channel:
    """Channel of a recording: name, quantity, unit of ``scale·(raw − offset)``, scale and offset."""

    name: str
    quantity: Quantity
    unit: str
    scale: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        if self.unit not in UNITS[self.quantity]:
            raise ValueError(
                f"channel {self.name!r}: unit {self.unit!r} is none of {', '.join(UNITS[self.quantity])}, "
                f"which a channel of {self.quantity.value} may have"
            )
        if not (LEAST_SCALE <= abs(self.scale) <= GREATEST_SCALE and abs(self.offset) <= GREATEST_SCALE):
            raise ValueError(
                f"channel {self.name!r}: scale {self.scale!r} and offset {self.offset!r} must be finite, "
                f"the scale not zero: {LEAST_SCALE:g} … {GREATEST_SCALE:g}, or the same negative where the axis is "
                f"reversed; the offset within ±{GREATEST_SCALE:g}"
            )

    @property
    def rate_unit(self) -> str:
        """Unit of the channel once an increment is divided by the sample period."""
        return {"rad": "rad/s", "m/s": "m/s^2"}.get(self.unit, self.unit) if self.quantity in INCREMENTS else self.unit

    def value(self, raw: V) -> V:
        """Return ``scale·(raw − offset)`` in the channel's `unit`, of a number or of an array."""
        return (raw - self.offset) * self.scale


@dataclass(frozen=True)
class NominalScale:
    """Conversion of the raw samples of some channels to nominal rates: ``gain·(raw − offset)``, each in `rate_unit`."""

    gain: Array
    """The channels' scales, times the sample rate where a channel gives increments, (channels,)."""
    offset: Array
    """Offsets of the raw samples, (channels,)."""

    @classmethod
    def of(cls, channels: Sequence[Channel], rate_hz: float) -> "NominalScale":
        """Return the conversion of these channels at a sample rate [Hz]."""
        per_second = (rate_hz if c.quantity in INCREMENTS else 1.0 for c in channels)
        gain = np.array([c.scale * factor for c, factor in zip(channels, per_second, strict=True)])
        return cls(gain, np.array([c.offset for c in channels]))

    def rates(self, raw: Array) -> Array:
        """Return the nominal rates of raw values (…, channels), each in its channel's `rate_unit`."""
        return (raw - self.offset) * self.gain

    def convert_rows(self, rows: Array) -> None:
        """Convert raw values to nominal rates in place, (channels, n)."""
        if np.any(self.offset):
            rows -= self.offset[:, None]
        rows *= self.gain[:, None]


@dataclass(frozen=True)
class Station:
    """Station of a procedure, one orientation and/or temperature: move there, let settle, record."""

    index: int
    label: str
    angles: TableAngles | None = None
    temperature_c: float | None = None
    settle_s: float = 0.0
    record_s: float = 0.0
    power_off_s: float = 0.0
    """Time for which the unit is switched off first [s]; above zero the station is a launch of its own."""
    turn: Turn | None = None
    """Whole turns of one axis that begin with the recording and are over, at rest again, before its end; None: none."""
    sinusoid: Sinusoid | None = None
    """Sinusoid of one axis under way during the whole recording, at rest again after it; None: none."""
    temperatures: bool = False
    """True if the unit's temperature sensors are recorded with its triads."""
    sample_rate_hz: float | None = None
    """Sample rate of the unit; None: its own rate. The same for all stations of a job."""
    current_ma: float | None = None
    """Current of the source into all three inputs of a lone converter; None: a whole unit is tested."""
    supply_voltage_v: float | None = None
    """Voltage of the unit's supply, set before it is switched on; None: as it is, nominal unless it was set before."""
    profile: TemperatureProfile | None = None
    """Temperature profile of the chamber meanwhile; the recording ends with the last soak, at most after `record_s`."""
    until: StopRule | None = None
    """Rule that may end the recording before `record_s`; None: it lasts so long."""


@dataclass(frozen=True)
class RecordingInfo:
    """Description of a recording, without its samples: unit, channels, rate, count, station, hash, launch."""

    id: str
    unit: str
    channels: tuple[Channel, ...]
    rate_hz: float
    count: int
    start_s: float = 0.0
    """Bench time of the first sample's beginning [s]."""
    station: Station | None = None
    content_hash: str = ""
    simulated: bool = False
    launched_s: float | None = None
    """Bench time at which the unit was switched on for this launch [s]; None where it is not known."""
    measured: Measured | None = None
    """Readings of table and supply meanwhile; None where there are none. The station keeps the commanded angles."""

    name: str = ""
    """Name by which people know it, such as that of its file; empty: it is known by its station, or by its id alone."""

    @property
    def title(self) -> str:
        """Name of the recording in a text for people: its own, else the label of its station, else its id."""
        return self.name or (self.station.label if self.station else self.id)

    @property
    def duration_s(self) -> float:
        return self.count / self.rate_hz

    @property
    def since_launch_s(self) -> float:
        """Time from switching the unit on to the first sample [s]; where the launch is not known, `start_s`."""
        return self.start_s - (self.launched_s or 0.0)

    def column(self, name: str) -> int:
        """Return the index of a channel by name, from 0. Raises `MissingChannel`."""
        for index, channel in enumerate(self.channels):
            if channel.name == name:
                return index
        raise MissingChannel(name, tuple(c.name for c in self.channels))

    def only(self, names: Sequence[str]) -> "RecordingInfo":
        """Return the description with some of the channels, in that order. Raises `MissingChannel`."""
        return replace(self, channels=tuple(self.channels[self.column(name)] for name in names))

    def nominal_scale(self, names: Sequence[str]) -> NominalScale:
        """Return the conversion of raw samples of some channels to nominal rates. Raises `MissingChannel`."""
        return NominalScale.of([self.channels[self.column(name)] for name in names], self.rate_hz)


class Recording(Protocol):
    """Samples that can be read again and again, block by block. Interface: in memory, or over the service's
    database.
    """

    @property
    def info(self) -> RecordingInfo: ...

    def blocks(self) -> Iterator[RawArray]:
        """Yield the raw samples in order, each block (n, channels)."""
        ...


@dataclass(frozen=True)
class MemoryRecording:
    """A recording held in memory: for tests and for work at a prompt; the service reads its own from storage."""

    info: RecordingInfo
    raw: RawArray = field(repr=False)

    def blocks(self) -> Iterator[RawArray]:
        yield self.raw


def titles(recordings: Sequence[Recording]) -> list[str]:
    """Return the titles of several recordings, in their order; equal ones carry the beginning of the id as well."""
    plain = [recording.info.title for recording in recordings]
    return [
        f"{title} ({recording.info.id[:8]})" if plain.count(title) > 1 and recording.info.id != title else title
        for title, recording in zip(plain, recordings, strict=True)
    ]


def rates(recording: Recording, names: Sequence[str]) -> Array:
    """Return all samples of some channels as nominal rates, shape (n, len(names)), in each channel's `rate_unit`.
    Raises `MissingChannel`.
    """
    columns = [recording.info.column(name) for name in names]
    raw = np.concatenate([np.asarray(block)[:, columns] for block in recording.blocks()] or [np.empty((0, len(names)))])
    return recording.info.nominal_scale(names).rates(raw.astype(np.float64))


def require_finite(info: RecordingInfo, names: Sequence[str], samples: Array) -> None:
    """Refuse samples (n, channels) that are not numbers. Raises `UnfitRecording` naming the channel."""
    bad = np.flatnonzero(~np.all(np.isfinite(samples), axis=0))
    if bad.size:
        raise UnfitRecording(
            f"recording {info.id}: channel {names[bad[0]]} holds samples that are not numbers: "
            "import it without gaps, or give a stretch without them (start_s and stop_s)"
        )


def require_complete(info: RecordingInfo, seen: int) -> None:
    """Refuse a recording if its blocks held another number of samples than it announces. Raises `UnfitRecording`."""
    if seen != info.count or not seen:
        raise UnfitRecording(f"recording {info.id}: {seen} samples where {info.count} are announced")
