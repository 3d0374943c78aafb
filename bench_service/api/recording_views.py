"""Recordings as answers: a recording without its samples, and a page of them."""

from datetime import datetime
from typing import Any

from pydantic import BaseModel, Field

from bench_service.mapping import copied
from bench_service.model.job import JobHeading
from bench_service.model.raw_data import RawState
from bench_service.model.records import RecordingState, StoredRecording
from procedures.core.measured import Measured
from procedures.core.recording import Channel, Station


class RecordingView(BaseModel):
    """A recording without its samples."""

    id: str
    unit: str
    job: str | None
    job_number: int | None = Field(None, description="Short number of that job; only in lists, and for one recording")
    procedure: str | None = Field(None, description="Procedure of that job; only in lists, and for one recording")
    bench: str | None
    station: Station | None
    state: RecordingState
    channels: list[Channel]
    rate_hz: float
    count: int
    duration_s: float
    start_s: float
    launched_s: float | None = Field(description="Bench time at which the unit was switched on; null: not known")
    measured: Measured | None = Field(
        description="Means of encoders and supply during the recording; null: they were not read"
    )
    content_hash: str = Field(description="SHA-256 of samples and channel description, whatever the chunks")
    simulated: bool
    stored_bytes: int
    chunks: int
    created_at: datetime
    raw: RawState = Field(description="Where the raw samples are; `removed`: reading them answers 410")
    raw_changed_at: datetime | None = Field(description="When the samples were moved there; null: never moved")
    source: dict[str, Any] = Field(
        description="Import: files, description, and `clock`, what its stamps say. Bench with a bench file: "
        "`origin` (real, mixed or simulated) and `devices`, with identities and certificates"
    )
    warnings: list[str] = Field(description="Findings of the import that a person should know")
    results: list[str] | None = Field(
        None, description="Results that used the recording, in the answer about this one alone"
    )

    @classmethod
    def of(
        cls, stored: StoredRecording, results: tuple[str, ...] | None = None, heading: JobHeading | None = None
    ) -> "RecordingView":
        """Convert a recording to its HTTP view; `heading`: number and procedure of its job."""
        warnings = [str(warning) for warning in stored.source.get("warnings", ())]
        number, procedure = (None, None) if heading is None else (heading.number, heading.procedure)
        return copied(
            cls,
            stored,
            stored.info,
            job=stored.job_id,
            job_number=number,
            procedure=procedure,
            warnings=warnings,
            results=results,
        )


class RecordingPage(BaseModel):
    """One page of recordings, newest first."""

    items: list[RecordingView]
    next: str | None
