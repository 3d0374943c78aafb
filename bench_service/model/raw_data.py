"""Raw data of recordings as values: where they are, rules by which they go, holds, and plans before anything goes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum


class RawState(StrEnum):
    """Place of a recording's raw samples. Description, hashes, results and lineage are in the database always."""

    STORED = "stored"
    """In the database."""
    ARCHIVING = "archiving"
    """Copied whole to the archive and checked there; chunks may be in the database still."""
    ARCHIVED = "archived"
    """In the archive alone; read from there."""
    RESTORING = "restoring"
    """On its way back from the archive; read from either."""
    REMOVING = "removing"
    """Removed by a rule; chunks may be in the database still, and are not read any more."""
    REMOVED = "removed"
    """Gone: reading them is refused."""


GONE = (RawState.REMOVING, RawState.REMOVED)
HERE = (RawState.STORED, RawState.RESTORING)


class Keeping(StrEnum):
    """Reason for which raw data stay that are old enough to be removed."""

    CALIBRATION = "calibration"
    """A current or an approved calibration or correction rests on it; certificates are issued for these."""
    HOLD = "hold"
    """A person holds it."""
    ANALYSIS = "analysis"
    """An analysis that has not ended wants it."""
    CAMPAIGN = "campaign"
    """Its campaign run has not ended."""


@dataclass(frozen=True)
class RawRule:
    """A rule of retention: which raw data are removed or archived, `days` after they were made or restored.

    Removal concerns routine passes only: recordings of a job that ended with the verdict pass. Archiving concerns every
    complete recording.
    """

    days: float
    only_passes: bool


@dataclass(frozen=True)
class Candidate:
    """A recording whose raw data are old enough for a rule, with its job and its size."""

    id: str
    job: str | None
    stored_bytes: int
    campaign_run: str | None
    """The campaign run that its job belongs to."""


@dataclass
class RawPlan:
    """The recordings whose raw data a rule concerns now, and those that it keeps."""

    rule: RawRule
    before: datetime
    """Only recordings made before this moment are old enough."""
    recordings: list[str] = field(default_factory=list[str])
    stored_bytes: int = 0
    kept: dict[Keeping, int] = field(default_factory=dict[Keeping, int])
    """Number of recordings that are old enough and kept, by the first reason that holds."""
    done: int = 0
    """Number of recordings whose raw data went; 0 of a dry run."""
    done_bytes: int = 0
    faults: list[str] = field(default_factory=list[str])
    """Sentences on recordings that could not be archived; they stay in the database."""


@dataclass(frozen=True)
class Hold:
    """A person's hold on a recording's raw data: no rule removes them while it stands."""

    id: str
    recording: str
    reason: str
    by: str
    held_at: datetime
    released_at: datetime | None = None
    released_by: str = ""


@dataclass(frozen=True)
class Share:
    """Recordings whose raw data are at one place, and the bytes of their chunks as they were stored."""

    recordings: int
    stored_bytes: int


@dataclass(frozen=True)
class Growth:
    """Stored bytes of recordings made in the last `days`, and those of them that are routine passes."""

    days: float
    stored_bytes: int
    passes_bytes: int


@dataclass(frozen=True)
class Prediction:
    """Size of the database some days ahead, from the growth of the last weeks, without and with the rules."""

    days: int
    without_rules_bytes: int
    with_rules_bytes: int


@dataclass(frozen=True)
class StorageReport:
    """The size of the database, what is in it, how it grows, and how large it will be."""

    stored_bytes: int
    reusable_bytes: int | None
    """Bytes inside an SQLite file that removed data left free; new data fill them first."""
    free_bytes: int | None
    raw: Mapping[RawState, Share]
    growth: Growth
    predicted: tuple[Prediction, ...]
    full_at: datetime | None
    """Moment at which the disk is full at this growth with the rules; None: beyond ten years, or not known."""
    remove_days: float | None
    archive_days: float | None
    archive: str | None
