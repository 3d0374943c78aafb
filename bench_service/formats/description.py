"""A person's description of a file that is to be imported: which column is which channel, and in which unit.

Nothing is guessed: a channel without a unit, or an unknown key, is refused before the file is opened.
"""

from enum import StrEnum
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from bench_service.formats.input_units import stored_channel
from procedures.core.recording import Channel, Quantity
from procedures.core.unit import SERIAL

Column = str | int
"""Column of a file by name, or by index from 0."""

DELIMITERS = {",": b",", ";": b";", "tab": b"\t", "whitespace": b" "}

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Seconds in one unit of a time column that holds numbers."""

TICKS = {**SECONDS, "100us": 1e-4}
"""The units above, and the ticks of 0.1 ms of Xsens' SampleTimeFine."""


GREATEST = 1e20
"""Greatest size of a scale, a period or an offset, its inverse the least scale: no sensor comes near."""

SLOWEST_HZ, FASTEST_HZ = 1e-9, 1e9


class Accumulated(StrEnum):
    """Quantity that a column adds up since some beginning; its steps from row to row are stored as increments."""

    ANGLE = "angle"
    VELOCITY = "velocity"


_INCREMENT_OF = {
    Accumulated.ANGLE: Quantity.ANGLE_INCREMENT,
    Accumulated.VELOCITY: Quantity.VELOCITY_INCREMENT,
}


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ImportedChannel(_Strict):
    """One channel: its column in the files, and its meaning. ``value = scale·(raw − offset)`` in `unit`."""

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,63}$", description="e.g. gyro_x")
    column: Column | None = Field(None, description="name, or index from 0; None: the column of the channel's name")
    file: int = Field(0, ge=0, description="which of the files, from 0")
    quantity: Quantity | Accumulated = Field(
        description="angle and velocity are accumulated values (a phase): their steps are stored as increments"
    )
    unit: str = Field(description="of scale·(raw − offset): rad/s, deg/s, m/s^2, g, …; count: the scale is not known")
    scale: float = 1.0
    offset: float = Field(0.0, ge=-GREATEST, le=GREATEST)
    period: float | None = Field(
        None,
        gt=0,
        le=GREATEST,
        description="for an angle or velocity: where its raw value begins again, 360 or 65536 for example",
    )

    @field_validator("scale")
    @classmethod
    def _is_of_a_sensor(cls, scale: float) -> float:
        if not 1.0 / GREATEST <= abs(scale) <= GREATEST:
            raise ValueError(
                f"scale {scale!r} must be finite, the scale not zero: {1.0 / GREATEST:g} … {GREATEST:g}, or the same "
                "negative where the axis is reversed; it is the number of units in one step of the raw values"
            )
        return scale

    @model_validator(mode="after")
    def _means_something(self) -> Self:
        if self.period is not None and not self.is_accumulated:
            raise ValueError(f"channel {self.name!r}: period is for the quantities angle and velocity")
        self.channel()
        return self

    @property
    def is_accumulated(self) -> bool:
        """Return whether the column's increments are stored, not its values."""
        return isinstance(self.quantity, Accumulated)

    def channel(self) -> Channel:
        """Return the channel of the recording, in the unit that is stored."""
        if isinstance(self.quantity, Accumulated):
            return stored_channel(self.name, _INCREMENT_OF[self.quantity], self.unit, self.scale, 0.0)
        return stored_channel(self.name, self.quantity, self.unit, self.scale, self.offset)

    @property
    def source_column(self) -> Column:
        return self.name if self.column is None else self.column


class Rows(_Strict):
    """A part of a table, counted in rows of data from 1; both ends belong to it."""

    first: int = Field(1, ge=1)
    last: int | None = Field(None, ge=1, description="None: to the end")

    @model_validator(mode="after")
    def _is_in_order(self) -> Self:
        if self.last is not None and self.last < self.first:
            raise ValueError(f"rows: the last, {self.last}, is before the first, {self.first}")
        return self


class ImportDescription(_Strict):
    """A person's description of files: all that must be known to read them as one recording of a unit."""

    unit: str = Field(pattern=SERIAL, description="serial of the unit")
    channels: tuple[ImportedChannel, ...] = Field(min_length=1, max_length=64)
    rate_hz: float | None = Field(None, gt=0, description="where there is no time column, or to be checked against it")
    time_column: Column | None = Field(None, description="name, or index from 0, the same in every file")
    time_unit: Literal["s", "ms", "us", "ns", "100us", "clock"] = Field(
        "s",
        description="of numbers (100us: ticks of 0.1 ms); clock: text such as 14:03:59.250, or with a date; typed time "
        "stamps, and clocks of log files, know their own",
    )
    clock_fraction: Literal["decimal", "ms", "us"] = Field(
        "decimal", description="for a clock's text: ms where 31.18 means 31.018 s, milliseconds without leading zeros"
    )
    unwrap_clock: bool = Field(False, description="whether a counter of time that began again is carried on")
    repeats: Literal["refuse", "drop"] = Field("refuse", description="rows that were written twice with one time")
    gaps: Literal["refuse", "mark"] = Field(
        "refuse", description="lost rows; mark: NaN takes their place, for analyses that leave gaps out"
    )
    start_s: float = Field(0.0, description="bench time of the first sample")
    rows: Rows = Field(
        default_factory=lambda: Rows.model_validate({}), description="the part of the table that is read"
    )
    header_lines: int = Field(0, ge=0, le=10_000, description="lines of a text file before the table")
    header: bool = Field(True, description="whether a line of column names follows (text files)")
    delimiter: Literal[",", ";", "tab", "whitespace"] = ","
    decimal: Literal[".", ","] = Field(".", description="the decimal mark of a text file's numbers")
    gap_tolerance: float = Field(
        0.2, gt=0, lt=1, description="of a time step against the sample period, relative: less is never looked at"
    )
    rate_tolerance: float = Field(
        0.005, gt=0, lt=1, description="of rate_hz, and of every 256 rows, against the time column, relative"
    )
    format: str | None = Field(
        None, max_length=40, description="of a log file, where it is not recognised; table: delimited text or columns"
    )
    table: str | None = Field(
        None, max_length=1000, description="of a log file with several: a topic, a message type, an archive's file"
    )
    second_time_column: Column | None = Field(
        None, description="of a log file with two clocks: the other one, which is inspected and kept with the source"
    )
    simulated: bool = False
    reference_values: dict[str, float] = Field(default_factory=dict, description="known truths, kept with the source")

    @field_validator("rate_hz")
    @classmethod
    def _is_a_rate(cls, rate_hz: float | None) -> float | None:
        if rate_hz is not None and not SLOWEST_HZ <= rate_hz <= FASTEST_HZ:
            raise ValueError(f"rate_hz {rate_hz!r}: {SLOWEST_HZ:g} … {FASTEST_HZ:g} Hz are taken, in samples a second")
        return rate_hz

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        names = [channel.name for channel in self.channels]
        if len(set(names)) != len(names):
            raise ValueError(f"channels: each needs its own name, got {', '.join(names)}")
        if self.rate_hz is None and self.time_column is None:
            raise ValueError("give rate_hz, or time_column, or both")
        if self.second_time_column is not None and self.time_column is None:
            raise ValueError("second_time_column: give time_column first")
        return self

    def columns_of(self, file: int) -> tuple[Column, ...]:
        """Return the columns that are read from a file, the time first where there is one."""
        time: tuple[Column, ...] = () if self.time_column is None else (self.time_column,)
        return (*time, *(c.source_column for c in self.channels if c.file == file))

    @property
    def time_scale_s(self) -> float:
        """Number of seconds in one unit of the time column; text of a clock is read in nanoseconds."""
        return TICKS.get(self.time_unit, 1e-9)

    def declared(self) -> dict[str, Any]:
        """Return the description as JSON, to be kept with the recording."""
        return self.model_dump(mode="json", exclude_defaults=True)
