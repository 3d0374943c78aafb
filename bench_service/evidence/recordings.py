"""Interfaces of the store of recordings and their raw samples, while they are made and afterwards.

Every method is one transaction: it commits, or it raises and nothing of it remains.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bench_service.model.errors import DamagedRecording
from bench_service.model.records import NewRecording, Page, StoredRecording
from bench_service.model.search import EVERYTHING, Search
from procedures.core.measured import Measured
from procedures.core.recording import RawArray, Recording, RecordingInfo

NAMED = 10
"""Damaged chunks that a refusal names."""


@dataclass(frozen=True)
class DamagedChunk:
    """A chunk of a recording whose samples start…stop (half open) cannot be had as they were stored."""

    number: int
    start: int
    stop: int
    why: str


class RecordingWriter(Protocol):
    """Writer of one recording. Chunks are committed as they fill; the recording is not listed before `seal`. Interface;
    the SQL is in `persistence`.
    """

    def write(self, block: RawArray) -> None:
        """Append samples, shape (n, channels), in the order of the channels; a full chunk is committed. Raises
        `StorageFull`.
        """
        ...

    def seal(self, checkpoint: dict[str, Any] | None = None, measured: Measured | None = None) -> RecordingInfo:
        """Store the last samples, the count and the content hash; from then on the recording is listed. Return its
        description.

        `checkpoint`: state of the simulated world, None on a real bench. `measured`: readings of the other devices
        meanwhile, None: none were read. Raises `UnfitRecording` without a sample, `StorageFull`.
        """
        ...

    def abandon(self) -> None:
        """End the recording without sealing; never raises. Whole chunks of a job's recording are kept as interrupted.

        An import, or a recording without a committed chunk, leaves nothing.
        """
        ...


class RecordingSoFar(Recording, Protocol):
    """The stored part of a recording that may still be growing; `count` of its `info` is that part's. Interface."""

    def since(self, start: int) -> Iterator[RawArray]:
        """Yield the raw samples from sample `start` on, in blocks of shape (n, channels)."""
        ...


class RecordingStore(Protocol):
    """Store of recordings and their samples. Interface; the SQL is in `persistence`."""

    def open(self, new: NewRecording) -> RecordingWriter: ...

    def get(self, recording_id: str) -> StoredRecording:
        """Return one recording's row, without samples. Raises `NotFound`."""
        ...

    def list(
        self,
        *,
        job_id: str | None = None,
        unit: str | None = None,
        simulated: bool | None = None,
        search: Search = EVERYTHING,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[StoredRecording]: ...

    def of_job(self, job_id: str) -> tuple[StoredRecording, ...]:
        """Return the complete recordings of a job in the order of their stations, without samples."""
        ...

    def load(self, recording_id: str, name: str = "") -> RecordingSoFar:
        """Return a recording for an analysis: its blocks are read chunk by chunk when they are used. Raises `NotFound`,
        `RawDataRemoved`.

        `name`: its name in the texts of the analysis; empty: that of its file.
        """
        ...

    def so_far(self, job_id: str) -> "RecordingSoFar | None":
        """Return the stored part of the recording that a job is making now; None where nothing of one is stored yet."""
        ...

    def read(
        self, recording_id: str, channels: Sequence[str] | None, start: int, stop: int
    ) -> Iterator[NDArray[np.int32] | NDArray[np.float64]]:
        """Raw samples start…stop (half open) of the named channels (None: all), chunk by chunk; archived ones come from
        the archive.

        Raises `NotFound`, `MissingChannel`, `RawDataRemoved`; `ArchiveAway` where the archive cannot be read.
        """
        ...

    def damage(self, recording_id: str, start: int, stop: int) -> Iterator[DamagedChunk]:
        """Compare the chunks that hold samples start…stop (half open) with their hashes; yield the damaged ones.

        Raises `NotFound`, `RawDataRemoved`, `ArchiveAway`.
        """
        ...

    def checkpoint(self, job_id: str) -> dict[str, Any] | None:
        """Return the state of the simulated world after the job's last complete recording; None where there is none."""
        ...

    def discard_open_imports(self, before: datetime) -> int:
        """Remove orphaned imports, begun before a moment and never sealed. Return their number."""
        ...

    def interrupt_open(self, job_id: str) -> int:
        """Close a job's open recordings after a crash (see `RecordingWriter.abandon`). Return their number."""
        ...


def require_undamaged(recordings: RecordingStore, recording_id: str, start: int, stop: int) -> None:
    """Check the chunks that hold samples start…stop (half open). Raises `DamagedRecording`, naming all of them."""
    found = list(recordings.damage(recording_id, start, stop))
    if not found:
        return
    named = "; ".join(f"chunk {c.number}, samples {c.start} to {c.stop - 1}: {c.why}" for c in found[:NAMED])
    more = f"; and {len(found) - NAMED} more" if len(found) > NAMED else ""
    raise DamagedRecording(
        f"recording {recording_id} is damaged: {named}{more}. Other samples can be exported by start_s and stop_s; a "
        "copy of the database from before the damage has them all"
    )
