"""PORTS of memory: what the machine room must be able to remember. `persistence` implements them once, in SQL.

Every method is one transaction: it commits, or it raises and nothing of it remains.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from bench_service.jobs.job import Event, Failure, Job, JobState
from procedures.bench import BenchDescription
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Verdict
from procedures.core.recording import Channel, RawArray, Recording, RecordingInfo, Station
from procedures.core.unit import Unit

T = TypeVar("T")


@dataclass(frozen=True)
class Page(Generic[T]):
    """A page of a list, newest first; `next` is the cursor of the following page or None."""

    items: tuple[T, ...]
    next: str | None = None


class RecordingState(StrEnum):
    """`open` while samples arrive (never listed), `complete`, or `interrupted`: kept, but not for analysis."""

    OPEN = "open"
    COMPLETE = "complete"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class StoredRecording:
    """A recording's row: what it is, where it came from, what it weighs."""

    info: RecordingInfo
    state: RecordingState
    created_at: datetime
    job_id: str | None = None
    bench: str | None = None
    stored_bytes: int = 0
    chunks: int = 0
    dtype: str = "int32"
    """Of its samples: "int32" or "float64"."""
    source: dict[str, Any] = field(default_factory=dict[str, Any])
    """Of an imported recording: file name, its SHA-256, reader, declared reference values."""


@dataclass(frozen=True)
class NewRecording:
    """What must be known before the first sample."""

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
    idempotency: "Idempotency | None" = None
    """A client's key, remembered when the recording is sealed."""


class RecordingWriter(Protocol):
    """A recording while it is made. Chunks are committed as they fill; nothing is listed before `seal`."""

    def write(self, block: RawArray) -> None:
        """Append samples, shape (n, channels), in the order of the channels. Raises `StorageFull`."""
        ...

    def seal(self, checkpoint: dict[str, Any] | None = None) -> RecordingInfo:
        """Write the rest, the count and the content hash; with the world's checkpoint. Raises `StorageFull`."""
        ...

    def abandon(self) -> None:
        """End without sealing: kept as interrupted if a chunk was committed, else nothing remains."""
        ...


class RecordingStore(Protocol):
    """Raw samples."""

    def open(self, new: NewRecording) -> RecordingWriter: ...

    def made_before(self, idempotency: "Idempotency | None") -> RecordingInfo | None:
        """The recording that a client's key made. Raises `IdempotencyConflict` for a key of another request."""
        ...

    def get(self, recording_id: str) -> StoredRecording:
        """Raises `NotFound`."""
        ...

    def list(
        self, *, job_id: str | None = None, unit: str | None = None, after: str | None = None, limit: int = 50
    ) -> Page[StoredRecording]: ...

    def of_job(self, job_id: str) -> tuple[StoredRecording, ...]:
        """The complete recordings of a job in the order of their stations."""
        ...

    def load(self, recording_id: str) -> Recording:
        """The recording for an analysis: blocks are read chunk by chunk. Raises `NotFound`."""
        ...

    def read(
        self, recording_id: str, channels: Sequence[str] | None, start: int, stop: int
    ) -> Iterator[NDArray[np.int32] | NDArray[np.float64]]:
        """Raw samples start…stop (half open) of some channels, chunk by chunk. Raises `NotFound`, `MissingChannel`."""
        ...

    def checkpoint(self, job_id: str) -> dict[str, Any] | None:
        """What the world was after the job's last complete recording."""
        ...

    def discard_open_imports(self, before: datetime) -> int:
        """After a crash: remove imports that were begun before a moment and never sealed. How many there were."""
        ...

    def interrupt_open(self, job_id: str) -> int:
        """After a crash: close the job's open recordings (see `RecordingWriter.abandon`). How many there were."""
        ...


class JobStore(Protocol):
    """Jobs and their events. Every change of state appends an event in the same transaction."""

    def add(self, job: Job, idempotency: "Idempotency | None" = None) -> Job:
        """Store a new job; or, where the key is known with the same fingerprint, return the job it made.

        Raises `IdempotencyConflict`.
        """
        ...

    def get(self, job_id: str) -> Job:
        """Raises `NotFound`."""
        ...

    def list(
        self,
        *,
        state: JobState | None = None,
        procedure: str | None = None,
        unit: str | None = None,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[Job]: ...

    def counts(self) -> dict[JobState, int]:
        """How many jobs there are in each state."""
        ...

    def transition(
        self,
        job_id: str,
        to: JobState,
        *,
        at: datetime,
        verdict: Verdict | None = None,
        failure: Failure | None = None,
        result_id: str | None = None,
    ) -> Job:
        """Change state; to the state it is already in, it is a no-op. Raises `IllegalTransition`, `NotFound`."""
        ...

    def station_done(self, job_id: str, station: int, at: datetime, data: dict[str, Any]) -> Job:
        """Note that recordings up to and including `station` (index) are complete; idempotent."""
        ...

    def set_context(self, job_id: str, context: dict[str, Any]) -> Job:
        """Replace what was known at submission by what is known at the start."""
        ...

    def request_cancel(self, job_id: str, at: datetime) -> Job:
        """Ask a job to end: a queued one is cancelled at once, a running one at its next block.

        Raises `IllegalTransition` for a job that has ended.
        """
        ...

    def cancel_requested(self, job_id: str) -> bool: ...

    def note(self, job_id: str, kind: str, at: datetime, data: dict[str, Any]) -> None:
        """Append an event that changes no state."""
        ...

    def events(self, job_id: str, after: int = 0, limit: int = 1000) -> tuple[Event, ...]:
        """Events with a sequence greater than `after`, in order. Raises `NotFound`."""
        ...


@dataclass(frozen=True)
class Idempotency:
    """A client's key and the fingerprint of what it asked."""

    key: str
    fingerprint: str


@dataclass(frozen=True)
class StoredResult:
    """What an analysis said, and everything that made it."""

    id: str
    kind: str
    """"procedure" or "method"."""
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


@dataclass(frozen=True)
class StoredCalibration:
    """A calibration in a unit's history."""

    id: str
    unit: str
    result_id: str
    made_at: datetime
    current: bool
    triads: tuple[TriadCalibration, ...]
    simulated: bool


class ResultStore(Protocol):
    """Results, calibrations and lineage."""

    def add(
        self,
        result: StoredResult,
        calibrations: Sequence[TriadCalibration] = (),
        make_current: bool = True,
        idempotency: "Idempotency | None" = None,
    ) -> StoredResult:
        """Store a result with its lineage, and its calibrations as the unit's current ones, in one transaction.

        Raises `IdempotencyConflict`; a known key with the same fingerprint returns the first result.
        """
        ...

    def get(self, result_id: str) -> StoredResult:
        """Raises `NotFound`."""
        ...

    def list(
        self, *, job_id: str | None = None, unit: str | None = None, after: str | None = None, limit: int = 50
    ) -> Page[StoredResult]: ...

    def of_recording(self, recording_id: str) -> tuple[str, ...]:
        """Ids of the results that used a recording."""
        ...

    def calibrations(self, unit: str, after: str | None = None, limit: int = 50) -> Page[StoredCalibration]:
        """A unit's calibrations, newest first."""
        ...

    def calibration(self, calibration_id: str) -> StoredCalibration:
        """Raises `NotFound`."""
        ...

    def current_calibration(self, unit: str) -> StoredCalibration | None: ...


class UnitStore(Protocol):
    """Units and benches: what is declared of them."""

    def put_unit(self, unit: Unit) -> None:
        """Create or replace; the calibrations of the record are not stored here (`ResultStore` has them)."""
        ...

    def unit(self, serial: str) -> Unit:
        """With its current calibration. Raises `NotFound`."""
        ...

    def units(self) -> tuple[Unit, ...]: ...

    def put_bench(self, bench: BenchDescription) -> None: ...

    def bench(self, bench_id: str) -> BenchDescription:
        """Raises `NotFound`."""
        ...

    def benches(self) -> tuple[BenchDescription, ...]: ...


class Lease(Protocol):
    """The right to drive a bench, held for a process's life."""

    def release(self) -> None: ...


@dataclass(frozen=True)
class Stores:
    """All memory of one service."""

    jobs: JobStore
    recordings: RecordingStore
    results: ResultStore
    units: UnitStore
