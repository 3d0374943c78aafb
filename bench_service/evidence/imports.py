"""Import of recorded files as recordings of a unit."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from datetime import timedelta

from bench_service.evidence.stores import EvidenceStores
from bench_service.evidence.units import register
from bench_service.formats.description import ImportDescription
from bench_service.formats.import_request import Imported, ImportFile
from bench_service.formats.proposal.model import Proposal
from bench_service.formats.reader.client import FileReader, NoReader, NoRoom
from bench_service.model.errors import NotReady, StorageFull
from bench_service.model.records import Idempotency, NewRecording
from bench_service.model.request import fingerprint
from bench_service.wall_clock import now
from procedures.core.recording import RecordingInfo
from procedures.core.unit import Unit

CRASHED_IMPORT = timedelta(hours=1)
"""Age at which an unsealed import counts as orphaned: its process is gone."""


class ImportService:
    """Stores recorded files as recordings."""

    def __init__(self, stores: EvidenceStores) -> None:
        self._stores = stores
        self._reader = FileReader()

    def close(self) -> None:
        """End the process that reads files."""
        self._reader.close()

    def discard_crashed(self) -> int:
        """Remove imports orphaned by a crash; return their number."""
        return self._stores.recordings.discard_open_imports(now() - CRASHED_IMPORT)

    def import_recording(
        self, files: Sequence[ImportFile], description: ImportDescription, key: str | None = None
    ) -> RecordingInfo:
        """Store recorded files as one recording of a unit, which is registered where it is new.

        Raises `DomainError` naming file and row, `StorageFull`; then nothing of the recording remains.
        """
        with self._reading(files, description) as imported:
            return self._store(imported, key)

    def describe(self, file: ImportFile, unit: str | None, form: str | None, table: str | None) -> Proposal:
        """Propose a description of a file, for a person to confirm; nothing is stored. Raises `DomainError`."""
        with _in_service_words():
            return self._reader.describe(file, unit, form, table)

    @contextmanager
    def _reading(self, files: Sequence[ImportFile], description: ImportDescription) -> Generator[Imported]:
        """Read the files in a process of their own."""
        with _in_service_words(), self._reader.reading(files, description) as imported:
            yield imported

    def _store(self, imported: Imported, key: str | None) -> RecordingInfo:
        description = imported.description
        idempotency = None if key is None else Idempotency(f"recordings:{key}", fingerprint(imported.source))
        recordings = self._stores.recordings
        known = self._stores.keys.made(idempotency, "recording")
        if known is not None:
            return recordings.get(known).info
        register(self._stores.units, Unit(description.unit, imported.rate_hz, imported.channels))
        writer = recordings.open(
            NewRecording(
                unit=description.unit,
                channels=imported.channels,
                rate_hz=imported.rate_hz,
                start_s=description.start_s,
                simulated=description.simulated,
                dtype=imported.dtype,
                source=imported.source,
                gaps=description.gaps == "mark",
                idempotency=idempotency,
            )
        )
        try:
            for block in imported.blocks():
                writer.write(block)
            return writer.seal()
        except BaseException:
            writer.abandon()
            raise


@contextmanager
def _in_service_words() -> Generator[None]:
    """Report what becomes of the reading process as an error of the service."""
    try:
        yield
    except NoRoom as error:
        raise StorageFull(str(error)) from error
    except NoReader as error:
        raise NotReady([str(error)]) from error
