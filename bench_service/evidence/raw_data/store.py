"""Interfaces of the store of raw data: the rows that say where the samples of recordings are, and the archive."""

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from typing import Protocol

from bench_service.model.raw_data import Candidate, Growth, Hold, RawRule, RawState, Share


class RawDataStore(Protocol):
    """Store of the places of raw data. Every method is one transaction, but for those that say otherwise. Interface;
    the SQL is in `persistence`.
    """

    def candidates(self, rule: RawRule, before: datetime) -> Iterator[Candidate]:
        """Yield complete recordings with raw data in the database that are older than `before`, oldest first; read page
        by page.
        """
        ...

    def of_calibrations(self) -> frozenset[str]:
        """Return the ids of recordings on which a current or approved calibration or correction rests, by way of
        whatever results.
        """
        ...

    def held(self) -> frozenset[str]:
        """Return the ids of recordings on which a hold stands."""
        ...

    def of_open_analyses(self) -> frozenset[str]:
        """Return the ids of recordings that are inputs of a task which has not ended."""
        ...

    def open_campaign_runs(self) -> frozenset[str]:
        """Return the ids of the campaign runs that have not ended."""
        ...

    def unfinished(self) -> tuple[tuple[str, RawState], ...]:
        """Return (id, state) of recordings whose removal, archiving or restoration a crash left half done."""
        ...

    def remove(self, recording_id: str, at: datetime) -> bool:
        """Remove the raw data of a recording; several transactions, of which the first decides.

        False where they are not in the database any more, or something wants them meanwhile (see `Keeping`).
        """
        ...

    def archive(self, recording_id: str, place: str, at: datetime) -> bool:
        """Empty the chunks of a recording whose copy is whole and checked; several transactions, the first decides.

        False where they are not in the database any more.
        """
        ...

    def restore(self, recording_id: str, at: datetime) -> bool:
        """Bring the chunks of a recording back from its archive, each checked against its hash; several transactions.

        False where nothing of it is archived. Raises `ArchiveAway`, `DamagedRecording`.
        """
        ...

    def add_hold(self, hold: Hold) -> Hold:
        """Store a hold and return it. Raises `NotFound` for the recording, `RawDataRemoved` where there is nothing left
        to hold.
        """
        ...

    def release_hold(self, hold_id: str, by: str, at: datetime) -> Hold:
        """Store the release of a hold and return it. Raises `NotFound`, `IllegalTransition` for one that was
        released.
        """
        ...

    def holds(self, recording_id: str | None = None) -> tuple[Hold, ...]:
        """Return the standing holds, of one recording or all, newest first."""
        ...

    def archive_at(self, address: str) -> "Archive":
        """Open the archive at an address. Raises `ArchiveAway` where it is first used and cannot be."""
        ...

    def shares(self) -> Mapping[RawState, Share]:
        """Return number of recordings and stored bytes by the place of their raw data (database, archive,
        removed, …).
        """
        ...

    def growth(self, since: datetime, at: datetime) -> Growth:
        """Return the growth of the database's raw data since a moment [bytes]."""
        ...

    def passes_bytes_before(self, moments: Sequence[datetime]) -> tuple[int, ...]:
        """Return, for each of some moments, the stored bytes of routine passes in the database that were made before
        it.
        """
        ...


class Archive(Protocol):
    """An archive of chunks and of the tables with them, a Parquet dataset. Interface; see
    `persistence/archive/dataset.py`.
    """

    place: str
    """Address of the archive, as it is stored with each recording."""

    def copy(self, recording_id: str) -> None:
        """Copy the chunks of a recording from the database, and read each copy back against its hash.

        Raises `ArchiveAway` where the archive cannot be written, `DamagedRecording` where a chunk is damaged already.
        """
        ...

    def write_tables(self) -> None:
        """Write what is new of units, recordings, chunks, results, quantities and lineage into the archive's tables.
        Raises `ArchiveAway`.
        """
        ...
