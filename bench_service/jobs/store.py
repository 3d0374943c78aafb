"""PORTS of memory: what the machine room must be able to remember. `persistence` implements them once, in SQL.

Every method is one transaction: it commits, or it raises and nothing of it remains.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bench_service.jobs.audit import AuditTrail
from bench_service.jobs.campaigns.store import CampaignStore
from bench_service.jobs.corrections import CorrectionStore
from bench_service.jobs.job import Event, Failure, Job, JobState
from bench_service.jobs.live import LiveStore
from bench_service.jobs.prompts import PromptStore
from bench_service.jobs.queue import QueueStore
from bench_service.jobs.reservation import ReservationStore
from bench_service.jobs.results import ResultStore
from bench_service.jobs.stored import (
    BenchStop,
    Idempotency,
    NewRecording,
    Page,
    StoredRecording,
)
from bench_service.jobs.tallies import TallyStore
from procedures.bench import BenchDescription
from procedures.core.limits import Verdict
from procedures.core.recording import RawArray, Recording, RecordingInfo
from procedures.core.unit import Unit


class RecordingWriter(Protocol):
    """A recording while it is made. Chunks are committed as they fill; nothing is listed before `seal`."""

    def write(self, block: RawArray) -> None:
        """Append samples, shape (n, channels), in the order of the channels. Raises `StorageFull`."""
        ...

    def seal(self, checkpoint: dict[str, Any] | None = None) -> RecordingInfo:
        """Write the rest, the count and the content hash; with the world's checkpoint. Raises `StorageFull`."""
        ...

    def abandon(self) -> None:
        """End without sealing; never raises. Whole chunks of a job's recording are kept as interrupted; an import, or
        a recording without a committed chunk, leaves nothing."""
        ...


class RecordingStore(Protocol):
    """Raw samples."""

    def open(self, new: NewRecording) -> RecordingWriter: ...

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
    """Jobs and their events. Every change of state appends an event in the same transaction.

    A job that is not understood is left out of lists; every method that gives one raises `NotUnderstood`."""

    def add(self, job: Job, idempotency: Idempotency | None = None) -> Job:
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

    def interrupt(self, job_id: str, at: datetime, failure: Failure) -> None:
        """The service cannot go on with a job, and says why; one that was to be cancelled is.

        The job is not read, so it need not be understood.
        """
        ...

    def station_done(self, job_id: str, station: int, at: datetime, data: dict[str, Any]) -> Job:
        """Note that recordings up to and including `station` (index) are complete; idempotent."""
        ...

    def set_context(self, job_id: str, context: dict[str, Any]) -> Job:
        """Replace what was known at submission by what is known at the start."""
        ...

    def request_cancel(self, job_id: str, at: datetime) -> Job:
        """A queued job is cancelled at once, a running one soon; `NotUnderstood` is raised after that.

        Raises `IllegalTransition` for one that has ended.
        """
        ...

    def cancel_requested(self, job_id: str) -> bool: ...

    def request_pause(self, job_id: str, at: datetime) -> Job:
        """Ask a job to be put aside: a queued one is paused at once, a running one before its next station.

        Raises `IllegalTransition` for a job that has ended or was interrupted; for a paused one it is a no-op.
        """
        ...

    def put_aside(self, job_id: str, at: datetime) -> Job:
        """A job whose bench was made safe for a pause becomes paused; queued again, where the wish was taken back."""
        ...

    def resume(self, job_id: str, at: datetime) -> Job:
        """Queue a paused or interrupted job again, as its next attempt; from a running one a wish to pause is taken.

        Raises `IllegalTransition` for a job in another state.
        """
        ...

    def note(self, job_id: str, kind: str, at: datetime, data: dict[str, Any]) -> None:
        """Append an event that changes no state."""
        ...

    def events(self, job_id: str, after: int = 0, limit: int = 1000) -> tuple[Event, ...]:
        """Events with a sequence greater than `after`, in order. Raises `NotFound`."""
        ...

    def last_event(self, job_id: str) -> tuple[int, JobState]:
        """Sequence of the newest event, and the state that goes with it, read at one moment. Raises `NotFound`."""
        ...

    def on_event(self, tell: Callable[[str], None]) -> None:
        """From now on call `tell(job_id)` after each commit of this process that appended an event."""
        ...


class UnitStore(Protocol):
    """Units and benches: what is declared of them."""

    def put_unit(self, unit: Unit) -> None:
        """Create or replace; calibrations and corrections of the record are not stored here: `ResultStore` has them."""
        ...

    def unit(self, serial: str) -> Unit:
        """With its current calibration and corrections. Raises `NotFound`."""
        ...

    def units(self) -> tuple[Unit, ...]: ...

    def put_bench(self, bench: BenchDescription, mounted: Sequence[str] = ()) -> None:
        """Register a bench with the serials of the units that it can test."""
        ...

    def mounted(self, bench_id: str) -> tuple[str, ...]:
        """The serials of the units that a bench can test. Raises `NotFound`."""
        ...

    def bench(self, bench_id: str) -> BenchDescription:
        """Raises `NotFound`."""
        ...

    def benches(self) -> tuple[BenchDescription, ...]: ...

    def stop_bench(self, stop: BenchStop) -> None:
        """Note that a bench was stopped; it stays so until it is released. A second stop changes nothing."""
        ...

    def confirm_safe(self, bench_id: str, at: datetime, by: str) -> None:
        """Note that a stopped bench was seen safe; only the first time counts, and only while the stop stands."""
        ...

    def release_bench(self, bench_id: str) -> None:
        """Let the bench work again; one that is not stopped stays as it is."""
        ...

    def bench_stop(self, bench_id: str) -> BenchStop | None:
        """Why the bench stands still, if a person stopped it."""
        ...


class KeyStore(Protocol):
    """What clients' keys made."""

    def made(self, idempotency: Idempotency | None, kind: str) -> str | None:
        """Id of the "job", "recording", "result", "campaign", "campaign_run" or "schedule" that a key made.

        None for a key that is new, and without one. Asked before anything is examined: what was made stays made, also
        where the same request would be refused now. Raises `IdempotencyConflict` for a key of another request.
        """
        ...


@dataclass(frozen=True)
class Stores:
    """All memory of one service."""

    jobs: JobStore
    queue: QueueStore
    reservations: ReservationStore
    recordings: RecordingStore
    results: ResultStore
    units: UnitStore
    campaigns: CampaignStore
    corrections: CorrectionStore
    live: LiveStore
    prompts: PromptStore
    audit: AuditTrail
    tallies: TallyStore
    keys: KeyStore
