"""A proposed description of a file, as JSON."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ProposedColumn(_Part):
    """A channel that is proposed: its column, and the origin of its unit and scale."""

    channel: str
    column: str | int
    quantity: str
    unit: str
    scale: float
    source: str = Field(description="Where quantity, unit and scale come from, in words")
    mean: float | None = Field(None, description="Mean of the values, in `unit`; null: no finite value")
    deviation: float | None = Field(None, description="Standard deviation of the values, in `unit`")
    unit_doubt: str | None = Field(
        None, description="Sentence of `unknown` that asks about `unit`; null: the unit is no guess"
    )


class ProposedTable(_Part):
    """A table of a log file."""

    name: str
    rows: int | None
    columns: list[str] = Field(description="Names of its columns, at most 64 of them")
    notes: list[str] = Field(default_factory=list)


class InspectedClock(_Part):
    """A time column, and what the inspection of its stamps says."""

    column: str | int
    meaning: str
    time_unit: str
    rate_hz: float | None = Field(None, description="null: no rate was found")
    arrival: str | None = Field(None, description="How rows arrive: steady, coarse, jitter, batch …")
    lost_samples: int = 0
    repeated_rows: int = 0
    problem: str | None = Field(None, description="Why it cannot be the time of the samples; null: it can")
    warnings: list[str] = Field(default_factory=list)


class Proposal(_Part):
    """A proposed description, for a person to confirm."""

    format: str
    title: str = Field(description="The format, in words")
    file: str
    table: str | None = Field(description="The table that the description is of; null: the file has one alone")
    rows: int | None
    rate_hz: float | None
    description: dict[str, Any] = Field(
        description="An ImportDescription, to be sent once `unknown` is settled; unit is null where none was given"
    )
    columns: list[ProposedColumn]
    clocks: list[InspectedClock]
    tables: list[ProposedTable]
    unknown: list[str] = Field(description="What the file cannot say: a person has to decide it before the import")
    suspicious: list[str] = Field(description="What was found in the file that a person should look at")
    notes: list[str]
