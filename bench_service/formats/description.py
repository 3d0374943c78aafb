"""What a person says of a file that is to be imported: which column is which channel, and in which unit.

Nothing is guessed: a channel without a unit, or an unknown key, is refused before the file is opened.
"""

from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from procedures.core.recording import Channel, Quantity
from procedures.core.unit import SERIAL

Column = str | int
"""By name, or by index from 0."""

DELIMITERS = {",": b",", ";": b";", "tab": b"\t", "whitespace": b" "}


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ImportedChannel(_Strict):
    """One channel: where it stands in the files, and what it means. ``value = scale·(raw − offset)`` in `unit`."""

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,63}$", description="e.g. gyro_x")
    column: Column | None = Field(None, description="name, or index from 0; None: the column of the channel's name")
    file: int = Field(0, ge=0, description="which of the files, from 0")
    quantity: Quantity
    unit: str = Field(description="of scale·(raw − offset); count: the scale is not known")
    scale: float = 1.0
    offset: float = 0.0

    @model_validator(mode="after")
    def _means_something(self) -> Self:
        self.channel()
        return self

    def channel(self) -> Channel:
        """The channel of the recording."""
        return Channel(self.name, self.quantity, self.unit, self.scale, self.offset)

    @property
    def source_column(self) -> Column:
        return self.name if self.column is None else self.column


class ImportDescription(_Strict):
    """All that must be known to read files as one recording of a unit."""

    unit: str = Field(pattern=SERIAL, description="serial of the unit")
    channels: tuple[ImportedChannel, ...] = Field(min_length=1, max_length=64)
    rate_hz: float | None = Field(None, gt=0, description="where there is no time column, or to be checked against it")
    time_column: Column | None = Field(None, description="name, or index from 0, the same in every file")
    time_unit: Literal["s", "ms", "us", "ns"] = "s"
    start_s: float = Field(0.0, description="bench time of the first sample")
    header_lines: int = Field(0, ge=0, le=10_000, description="lines of a text file before the table")
    header: bool = Field(True, description="whether a line of column names follows (text files)")
    delimiter: Literal[",", ";", "tab", "whitespace"] = ","
    gap_tolerance: float = Field(0.2, gt=0, lt=1, description="of a time step against the median, relative")
    rate_tolerance: float = Field(
        0.005, gt=0, lt=1, description="of rate_hz, and of every 256 rows, against the time column, relative"
    )
    simulated: bool = False
    reference_values: dict[str, float] = Field(default_factory=dict, description="known truths, kept with the source")

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        names = [channel.name for channel in self.channels]
        if len(set(names)) != len(names):
            raise ValueError(f"channels: each needs its own name, got {', '.join(names)}")
        if self.rate_hz is None and self.time_column is None:
            raise ValueError("give rate_hz, or time_column, or both")
        return self

    def columns_of(self, file: int) -> tuple[Column, ...]:
        """The columns that are read from a file, the time first where there is one."""
        time: tuple[Column, ...] = () if self.time_column is None else (self.time_column,)
        return (*time, *(c.source_column for c in self.channels if c.file == file))

    @property
    def time_scale_s(self) -> float:
        """Seconds in one unit of the time column."""
        return {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[self.time_unit]

    def declared(self) -> dict[str, Any]:
        """As JSON, to be kept with the recording."""
        return self.model_dump(mode="json", exclude_defaults=True)
