"""Base classes of results: what every result has, and what a part of a document is."""

from datetime import datetime
from typing import Any

from pydantic import BaseModel, ConfigDict


class Part(BaseModel):
    """A part of a result's document: not to be changed, and open for fields of a later service."""

    model_config = ConfigDict(extra="allow", frozen=True)


class Used(Part):
    """A recording that a result rests on, with the hash of its samples."""

    id: str
    content_hash: str


class Made(Part):
    """The lineage of a result: recordings, calibrations, corrections, parameters and code that made it."""

    recordings: tuple[Used, ...]
    calibrations: tuple[str, ...]
    corrections: tuple[str, ...]
    parameters: dict[str, Any]
    code_version: str
    simulated: bool
    seed: int | None
    job: str | None


class ResultHead(Part):
    """The fields that every result has beside its document."""

    id: str
    version: str
    unit: str | None
    verdict: str
    created_at: datetime
    lineage: Made
    page: str


class OtherResult(ResultHead):
    """A result of a procedure or method that this client does not know: its document is plain JSON."""

    kind: str
    name: str
    document: dict[str, Any]
