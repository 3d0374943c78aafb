"""Stored records as values: recordings, results, and the pages and keys around them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any, Generic, TypeVar

import numpy as np

from bench_service.model.quantities import Quantity
from bench_service.model.raw_data import RawState
from bench_service.model.request import fingerprint
from bench_service.wall_clock import new_id
from procedures.core.limits import Verdict
from procedures.core.recording import Channel, RecordingInfo, Station

T = TypeVar("T")


@dataclass(frozen=True)
class Page(Generic[T]):
    """A page of a list, newest first unless its method says otherwise; `next` is the cursor of the following page, None
    on the last one.
    """

    items: tuple[T, ...]
    next: str | None = None


@dataclass(frozen=True)
class Idempotency:
    """A client's idempotency key within its scope, and the fingerprint of its request."""

    key: str
    fingerprint: str

    @classmethod
    def of(cls, scope: str, key: str | None, request: object) -> "Idempotency | None":
        """Return the key of a request within a scope such as "jobs"; None for a client that sent no key."""
        return None if key is None else cls(f"{scope}:{key}", fingerprint(request))


class RecordingState(StrEnum):
    """`open` while samples arrive (never listed), `complete`, or `interrupted`: kept, but not for analysis."""

    OPEN = "open"
    COMPLETE = "complete"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class StoredRecording:
    """A recording's row: its description, state, origin, size and the place of its raw samples; no samples."""

    info: RecordingInfo
    state: RecordingState
    created_at: datetime
    job_id: str | None = None
    bench: str | None = None
    stored_bytes: int = 0
    chunks: int = 0
    dtype: str = "int32"
    """Type of its samples: "int32" or "float64"."""
    raw: RawState = RawState.STORED
    """Place of its raw samples."""
    raw_changed_at: datetime | None = None
    """Time at which its raw samples came to that place; None: they were never moved."""
    archive: str | None = None
    """Address of the archive that has, or had, its raw samples."""
    source: dict[str, Any] = field(default_factory=dict[str, Any])
    """Origin of an imported recording: file name, its SHA-256, reader, declared reference values."""

    @property
    def origin(self) -> str:
        """Origin of its samples: real, mixed, simulated, synthetic or imported."""
        stated = self.source.get("origin")
        if stated:
            return str(stated)
        return "simulated" if self.info.simulated else "imported" if self.source.get("files") else "real"

    @property
    def file_name(self) -> str:
        """Name of the first file of an imported recording; empty: it was recorded on a bench."""
        return next((str(file.get("name", "")) for file in self.source.get("files") or ()), "")


@dataclass(frozen=True)
class NewRecording:
    """Facts of a recording that must be known before its first sample: unit, channels, rate, start, job."""

    unit: str
    channels: tuple[Channel, ...]
    rate_hz: float
    start_s: float
    simulated: bool
    dtype: type[np.int32] | type[np.float64] = np.int32
    job_id: str | None = None
    bench: str | None = None
    station: Station | None = None
    source: dict[str, Any] = field(default_factory=dict[str, Any])
    launched_s: float | None = None
    gaps: bool = False
    """True where samples may be NaN, in the place of missing ones."""
    idempotency: Idempotency | None = None
    """A client's idempotency key, stored when the recording is sealed."""


@dataclass(frozen=True)
class BenchStop:
    """A software stop of a bench: it stands until a person releases it. A bench may have several at once."""

    bench: str
    at: datetime
    reason: str
    safe_at: datetime | None = None
    """Time when a process on the bench's host last saw the devices safe; None: not confirmed since the stop."""
    safe_by: str = ""
    """Process that had last commanded the devices at that time."""
    by: str = ""
    """Person who stopped the bench, if known, or the process that could not make it safe."""
    id: str = field(default_factory=new_id)
    released_at: datetime | None = None
    """Time of its release; None: it stands."""
    released_by: str = ""
    remark: str = ""
    """Remark of the person who released it."""
    entered_at: datetime | None = field(default=None, compare=False)
    """Time when the database took it, later than `at` where it was away; None: not stored, or stored before 0014."""

    @property
    def stands(self) -> bool:
        """True while no person has released the stop."""
        return self.released_at is None


SHOWN_STOPS = 3
"""Maximum number of reasons shown in one sentence; the list of stops has all of them."""


def reasons_of(stops: Sequence[BenchStop]) -> str:
    """Return the reasons why a bench is stopped as one sentence, the first few in full."""
    reasons = list(dict.fromkeys(stop.reason for stop in stops))
    more = f" (and {len(reasons) - SHOWN_STOPS} more reasons)" if len(reasons) > SHOWN_STOPS else ""
    return "; ".join(reasons[:SHOWN_STOPS]) + more


@dataclass(frozen=True)
class StoredResult:
    """The result of an analysis: its document and verdict, with all its inputs (lineage)."""

    id: str
    kind: str
    """Kind of result: "procedure" or "method"."""
    name: str
    version: str
    parameters: dict[str, Any]
    document: dict[str, Any]
    """The result model as JSON."""
    verdict: Verdict
    recordings: tuple[tuple[str, str], ...]
    """(id, content hash) of each recording used, in order."""
    calibrations: tuple[str, ...]
    """Ids of calibrations used."""
    code_version: str
    simulated: bool
    created_at: datetime
    unit: str | None = None
    job_id: str | None = None
    seed: int | None = None
    context: dict[str, Any] = field(default_factory=dict[str, Any])
    corrections: tuple[str, ...] = ()
    """Ids of correction sets used."""


@dataclass(frozen=True)
class ResultValue:
    """The value of a quantity in one result; None where the result lacks it."""

    result: str
    job: str | None
    at: datetime
    simulated: bool
    code_version: str
    quantity: Quantity | None
