"""PORTS of memory for the raw data of recordings: the rows that say where they are, and the archive."""

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from typing import Protocol

from bench_service.model.raw_data import Candidate, Growth, Hold, RawRule, RawState, Share


class RawDataStore(Protocol):
    """The places of raw data in the database. Every method is one transaction, but for those that say otherwise."""

    def candidates(self, rule: RawRule, before: datetime) -> Iterator[Candidate]:
        """Complete recordings with raw data in the database that are old enough, oldest first; read page by page."""
        ...

    def of_calibrations(self) -> frozenset[str]:
        """Recordings on which a current or approved calibration or correction rests, by way of whatever results."""
        ...

    def held(self) -> frozenset[str]:
        """Recordings on which a hold stands."""
        ...

    def of_open_analyses(self) -> frozenset[str]:
        """Recordings that a task wants which has not ended."""
        ...

    def open_campaign_runs(self) -> frozenset[str]:
        """Ids of the campaign runs that have not ended."""
        ...

    def unfinished(self) -> tuple[tuple[str, RawState], ...]:
        """Recordings whose removal, archiving or restoration a crash left half done."""
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
        """Add a hold. Raises `NotFound` for the recording, `RawDataRemoved` where there is nothing left to hold."""
        ...

    def release_hold(self, hold_id: str, by: str, at: datetime) -> Hold:
        """Release a hold. Raises `NotFound`, `IllegalTransition` for one that was released."""
        ...

    def holds(self, recording_id: str | None = None) -> tuple[Hold, ...]:
        """Standing holds, newest first."""
        ...

    def archive_at(self, address: str) -> "Archive":
        """Open the archive at an address. Raises `ArchiveAway` where it is first used and cannot be."""
        ...

    def shares(self) -> Mapping[RawState, Share]:
        """Recordings and stored bytes by the place of their raw data."""
        ...

    def growth(self, since: datetime, at: datetime) -> Growth:
        """The growth of the database's raw data since a moment."""
        ...

    def passes_bytes_before(self, moments: Sequence[datetime]) -> tuple[int, ...]:
        """Stored bytes of routine passes in the database that were made before each of some moments."""
        ...


class Archive(Protocol):
    """An archive of chunks and of the tables with them, a Parquet dataset."""

    place: str
    """Its address, as it is kept with each recording."""

    def copy(self, recording_id: str) -> None:
        """Copy the chunks of a recording from the database, and read each copy back against its hash.

        Raises `ArchiveAway` where the archive cannot be written, `DamagedRecording` where a chunk is damaged already.
        """
        ...

    def write_tables(self) -> None:
        """Bring the tables of units, recordings, chunks, results, quantities and lineage up to date.

        Raises `ArchiveAway`.
        """
        ...
