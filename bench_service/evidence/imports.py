"""Imports recorded files as recordings of a unit, and makes synthetic recordings."""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import timedelta

import numpy as np

from bench_service.evidence.stores import EvidenceStores
from bench_service.evidence.units import register
from bench_service.formats.description import ImportDescription
from bench_service.formats.import_request import Imported, ImportFile
from bench_service.formats.proposal.model import Proposal
from bench_service.formats.reader.client import FileReader, NoReader, NoRoom
from bench_service.model.errors import NotReady, StorageFull
from bench_service.model.records import Idempotency, NewRecording
from bench_service.wall_clock import now
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import Channel, RecordingInfo
from procedures.core.unit import Unit

CRASHED_IMPORT = timedelta(hours=1)
"""Age at which an unsealed import counts as orphaned: its process is gone."""


SYNTHETIC = "SYNTHETIC"
"""Serial of the unit that all synthetic recordings are of: their results join no other unit's history or trend."""
MOST_SAMPLES = 50_000_000
"""Most samples of a synthetic recording: 14 h at 1000 a second."""
SyntheticRates = Callable[[NoiseCoefficients, float, int, int], Iterator[Array]]
"""Source of noise: coefficients, rate [Hz], number of samples and seed to blocks of rates."""


@dataclass(frozen=True)
class Synthesis:
    """Request for a synthetic recording: one channel of chosen noise."""

    channel: Channel
    noise: NoiseCoefficients
    rate_hz: float
    duration_s: float
    seed: int

    @property
    def count(self) -> int:
        return round(self.duration_s * self.rate_hz)


def require_real(serial: str) -> None:
    """Refuse the serial of synthetic recordings for anything else. Raises `BadParameter`."""
    if serial.upper() == SYNTHETIC:
        raise BadParameter("unit", serial, "the serial of a unit: this one is that of synthetic recordings")


class ImportService:
    """Imports recorded files as recordings, by way of the process that reads files; also stores synthetic
    recordings.
    """

    def __init__(self, stores: EvidenceStores, synthetic: SyntheticRates | None = None) -> None:
        """Set up with the source of synthetic noise; None: there is none here."""
        self._stores = stores
        self._synthetic = synthetic
        self._reader = FileReader()

    def close(self) -> None:
        """End the process that reads files, and wait for it."""
        self._reader.close()

    def discard_crashed(self) -> int:
        """Remove imports orphaned by a crash; return their number."""
        return self._stores.recordings.discard_open_imports(now() - CRASHED_IMPORT)

    def import_recording(
        self, files: Sequence[ImportFile], description: ImportDescription, key: str | None = None
    ) -> RecordingInfo:
        """Read recorded files, store them as one recording of a unit, which is registered where it is new, and return
        its description.

        Raises `DomainError` naming file and row, `StorageFull`; then nothing of the recording remains.
        """
        require_real(description.unit)
        with self._reading(files, description) as imported:
            return self._store(imported, key)

    def synthesise(self, asked: Synthesis, key: str | None = None) -> RecordingInfo:
        """Store a record of chosen noise. It is marked as synthetic for ever, and of the unit `SYNTHETIC` alone.

        Raises `BadParameter`, `NotReady` where this process has no source of noise, `StorageFull`.
        """
        if not 2 <= asked.count <= MOST_SAMPLES:
            raise BadParameter("duration_s", asked.duration_s, f"2 … {MOST_SAMPLES} samples, not {asked.count}")
        if self._synthetic is None:
            raise NotReady(["synthetic recordings are made by the service of a simulated bench"])
        settings = {"noise": asdict(asked.noise), "seed": asked.seed, "channel": asked.channel.name}
        idempotency = Idempotency.of("synthetic", key, asked)
        recordings = self._stores.recordings
        known = self._stores.keys.made(idempotency, "recording")
        if known is not None:
            return recordings.get(known).info
        register(self._stores.units, Unit(SYNTHETIC, asked.rate_hz, (asked.channel,)))
        writer = recordings.open(
            NewRecording(
                unit=SYNTHETIC,
                channels=(asked.channel,),
                rate_hz=asked.rate_hz,
                start_s=0.0,
                simulated=True,
                dtype=np.float64,
                source={"origin": "synthetic", "synthetic": settings},
                idempotency=idempotency,
            )
        )
        try:
            for block in self._synthetic(asked.noise, asked.rate_hz, asked.count, asked.seed):
                writer.write(block[:, None])
            return writer.seal()
        except BaseException:
            writer.abandon()
            raise

    def describe(self, file: ImportFile, unit: str | None, form: str | None, table: str | None) -> Proposal:
        """Return a proposed description of a file, for a person to confirm; nothing is stored. Raises `DomainError`.
        `unit`, `form`, `table` as in `propose`.
        """
        with _in_service_words():
            return self._reader.describe(file, unit, form, table)

    @contextmanager
    def _reading(self, files: Sequence[ImportFile], description: ImportDescription) -> Generator[Imported]:
        """Read the files in a process of their own."""
        with _in_service_words(), self._reader.reading(files, description) as imported:
            yield imported

    def _store(self, imported: Imported, key: str | None) -> RecordingInfo:
        description = imported.description
        idempotency = Idempotency.of("recordings", key, imported.source)
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
