"""Numbers from what is stored already: methods, second analyses, reports; and recordings that come in from files.

Needs no bench and no worker; HTTP, pages and command line ask it in their own words.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from bench_service.formats.description import ImportDescription
from bench_service.formats.import_file import ImportFile, read_import
from bench_service.jobs.errors import NotFound
from bench_service.jobs.planning import Planner, register
from bench_service.jobs.request import fingerprint
from bench_service.jobs.runner import analysed, recordings_of
from bench_service.jobs.store import Stores
from bench_service.jobs.stored import Idempotency, NewRecording, RecordingState, StoredResult
from bench_service.wall_clock import new_id, now
from procedures import methods
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import Recording, RecordingInfo
from procedures.core.report import Report
from procedures.core.unit import Unit
from procedures.procedure import DatedCalibration, Evidence, Method, Outcome, Parameters

AnyMethod = Method[Parameters, Outcome]


@dataclass(frozen=True)
class AnalysisRequest:
    """A method and what it is to work on."""

    method: str
    recordings: tuple[str, ...] = ()
    calibrations: tuple[str, ...] = ()
    parameters: dict[str, Any] = field(default_factory=dict[str, Any])


class AnalysisDesk:
    """What can be asked of stored evidence. Every verb is complete when it returns."""

    def __init__(self, stores: Stores, planner: Planner, code_version: str) -> None:
        self._stores = stores
        self._planner = planner
        self._code_version = code_version

    @cached_property
    def methods(self) -> Mapping[str, AnyMethod]:
        """Every method by name."""
        return methods.discover()

    def analyse_again(self, job_id: str, parameters: dict[str, Any], key: str | None = None) -> StoredResult:
        """Analyse a job's recordings with other parameters; the first result stays as it is."""
        idempotency = None if key is None else Idempotency(f"again:{key}", fingerprint([job_id, parameters]))
        known = self._stores.keys.made(idempotency, "result")
        if known is not None:
            return self._stores.results.get(known)
        job = self._stores.jobs.get(job_id)
        recordings = recordings_of(self._stores, job_id)
        if len(recordings) < len(job.stations):
            raise UnfitRecording(f"job {job_id} has {len(recordings)} of its {len(job.stations)} recordings")
        merged = {**job.requested_parameters, **parameters}
        result = analysed(job, self._planner.procedure(job.procedure), merged, recordings, self._code_version)
        return self._stores.results.add(result.stored, result.calibrations, False, idempotency, result.corrections)

    def run_method(self, request: AnalysisRequest, key: str | None = None) -> StoredResult:
        """Run a method on stored recordings or calibrations. Raises `NotFound`, `DomainError`, `ValidationError`."""
        idempotency = None if key is None else Idempotency(f"analyses:{key}", fingerprint(request))
        known = self._stores.keys.made(idempotency, "result")
        if known is not None:
            return self._stores.results.get(known)
        _require_each_once("recordings", request.recordings)
        _require_each_once("calibrations", request.calibrations)
        method = self.method(request.method)
        params = method.params.model_validate(request.parameters)
        used = [self._stores.results.calibration(c) for c in request.calibrations]
        dated = tuple(DatedCalibration(c.id, c.made_at.isoformat(), c.triads) for c in used)
        evidence = Evidence(self._complete(request.recordings), dated)
        units = {r.info.unit for r in evidence.recordings} | {c.unit for c in used}
        if len(units) > 1:
            raise UnfitRecording(f"the evidence is of several units: {', '.join(sorted(units))}")
        serial = next(iter(units), None)
        outcome = method.analyse(evidence, params, None if serial is None else self._stores.units.unit(serial))
        stored = StoredResult(
            id=new_id(),
            kind="method",
            name=method.name,
            version=method.version,
            parameters=params.model_dump(mode="json"),
            document=outcome.model_dump(mode="json"),
            verdict=outcome.verdict,
            recordings=tuple((r.info.id, r.info.content_hash) for r in evidence.recordings),
            calibrations=request.calibrations,
            code_version=self._code_version,
            simulated=any(r.info.simulated for r in evidence.recordings) or any(c.simulated for c in used),
            created_at=now(),
            unit=serial,
        )
        gives = method.calibrations(outcome), method.corrections(outcome)
        return self._stores.results.add(stored, gives[0], False, idempotency, gives[1])

    def import_recording(
        self, files: Sequence[ImportFile], description: ImportDescription, key: str | None = None
    ) -> RecordingInfo:
        """Store recorded files as one recording of a unit, which is registered where it is new.

        Raises `DomainError` naming file and row, `StorageFull`; then nothing of the recording remains.
        """
        imported = read_import(files, description)
        idempotency = None if key is None else Idempotency(f"recordings:{key}", fingerprint(imported.source))
        recordings = self._stores.recordings
        known = self._stores.keys.made(idempotency, "recording")
        if known is not None:
            return recordings.get(known).info
        register(self._stores, Unit(description.unit, imported.rate_hz, imported.channels))
        writer = recordings.open(
            NewRecording(
                unit=description.unit,
                channels=imported.channels,
                rate_hz=imported.rate_hz,
                start_s=description.start_s,
                simulated=description.simulated,
                dtype=imported.dtype,
                source=imported.source,
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

    def method(self, name: str) -> AnyMethod:
        """Raises `NotFound`."""
        if name not in self.methods:
            raise NotFound("method", name)
        return self.methods[name]

    def report(self, result: StoredResult) -> Report:
        """What a person is shown of a result."""
        entry = self._planner.catalog.get(result.name) if result.kind == "procedure" else self.methods.get(result.name)
        if entry is None:
            return Report(f"{result.name} is no longer in the catalogue; the document below is as it was stored.")
        return entry.report(entry.result.model_validate(result.document))

    def _complete(self, ids: Sequence[str]) -> tuple[Recording, ...]:
        """Recordings by id. Raises `NotFound`, and `UnfitRecording` for one that was interrupted."""
        for recording_id in ids:
            stored = self._stores.recordings.get(recording_id)
            if stored.state is not RecordingState.COMPLETE:
                raise UnfitRecording(f"recording {recording_id} is {stored.state.value}: kept, but not for analysis")
        return tuple(self._stores.recordings.load(recording_id) for recording_id in ids)


def _require_each_once(field: str, ids: Sequence[str]) -> None:
    """The same evidence given twice would count as two. Raises `BadParameter`."""
    for position, known in enumerate(ids):
        if known in ids[:position]:
            raise BadParameter(f"{field}.{position}", known, "each is given once")
