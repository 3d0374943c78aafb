"""What the service answers: every response modelled. Units are in the field names."""

from datetime import datetime
from typing import Any

from pydantic import BaseModel, Field

from bench_service.jobs.driver import TrueTriad
from bench_service.jobs.stored import RecordingState, StoredCalibration, StoredRecording, StoredResult
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Verdict
from procedures.core.recording import Channel, Station
from procedures.core.unit import TriadRecord, Unit
from procedures.procedure import PredictedUncertainty

Labels = dict[str, str]


class ProcedureView(BaseModel):
    """A procedure with the JSON Schemas of what it takes and gives."""

    name: str
    title: str
    version: str
    parameters: dict[str, Any]
    result: dict[str, Any]


class Preview(BaseModel):
    """A plan before anything moves."""

    procedure: str
    unit: str
    bench: str
    parameters: dict[str, Any]
    stations: list[Station]
    duration_s: float
    data_bytes: int
    predicted_uncertainties: list[PredictedUncertainty]
    basis: str = Field(description="What the prediction rests on: a calibration, or nominal scale factors")
    warnings: list[str]
    violations: list[str]


class RecordingView(BaseModel):
    """A recording without its samples."""

    id: str
    unit: str
    job: str | None
    bench: str | None
    station: Station | None
    state: RecordingState
    channels: list[Channel]
    rate_hz: float
    count: int
    duration_s: float
    start_s: float
    launched_s: float | None = Field(description="Bench time at which the unit was switched on; null: not known")
    content_hash: str = Field(description="SHA-256 of samples and channel description, whatever the chunks")
    simulated: bool
    stored_bytes: int
    chunks: int
    created_at: datetime
    source: dict[str, Any]
    results: list[str] | None = Field(None, description="Results that used it; only where one recording is asked for")

    @classmethod
    def of(cls, stored: StoredRecording, results: tuple[str, ...] | None = None) -> "RecordingView":
        info = stored.info
        return cls(
            id=info.id,
            unit=info.unit,
            job=stored.job_id,
            bench=stored.bench,
            station=info.station,
            state=stored.state,
            channels=list(info.channels),
            rate_hz=info.rate_hz,
            count=info.count,
            duration_s=info.duration_s,
            start_s=info.start_s,
            launched_s=info.launched_s,
            content_hash=info.content_hash,
            simulated=info.simulated,
            stored_bytes=stored.stored_bytes,
            chunks=stored.chunks,
            created_at=stored.created_at,
            source=stored.source,
            results=None if results is None else list(results),
        )


class RecordingPage(BaseModel):
    """Recordings, newest first."""

    items: list[RecordingView]
    next: str | None


class Lineage(BaseModel):
    """What made a number."""

    recordings: list[dict[str, str]] = Field(description="id and content hash of each recording, in order")
    calibrations: list[str]
    corrections: list[str] = Field(description="Ids of the correction sets that were applied")
    parameters: dict[str, Any]
    code_version: str
    simulated: bool
    seed: int | None
    job: str | None


class ResultView(BaseModel):
    """A result: the document of its procedure or method, and its lineage."""

    id: str
    kind: str
    name: str
    version: str
    unit: str | None
    verdict: Verdict
    created_at: datetime
    document: dict[str, Any]
    lineage: Lineage
    page: str

    @classmethod
    def of(cls, result: StoredResult) -> "ResultView":
        return cls(
            id=result.id,
            kind=result.kind,
            name=result.name,
            version=result.version,
            unit=result.unit,
            verdict=result.verdict,
            created_at=result.created_at,
            document=result.document,
            lineage=Lineage(
                recordings=[{"id": i, "content_hash": h} for i, h in result.recordings],
                calibrations=list(result.calibrations),
                corrections=list(result.corrections),
                parameters=result.parameters,
                code_version=result.code_version,
                simulated=result.simulated,
                seed=result.seed,
                job=result.job_id,
            ),
            page=f"/results/{result.id}",
        )


class ResultPage(BaseModel):
    """Results, newest first."""

    items: list[ResultView]
    next: str | None


class CalibrationView(BaseModel):
    """A calibration in a unit's history."""

    id: str
    unit: str
    result: str
    made_at: datetime
    current: bool
    simulated: bool
    triads: list[TriadCalibration]

    @classmethod
    def of(cls, stored: StoredCalibration) -> "CalibrationView":
        return cls(
            id=stored.id,
            unit=stored.unit,
            result=stored.result_id,
            made_at=stored.made_at,
            current=stored.current,
            simulated=stored.simulated,
            triads=list(stored.triads),
        )


class CalibrationPage(BaseModel):
    """Calibrations of a unit, newest first."""

    items: list[CalibrationView]
    next: str | None


class UnitView(BaseModel):
    """A unit as it is declared."""

    serial: str
    sample_rate_hz: float
    channels: list[Channel]
    gyro: TriadRecord | None
    accelerometer: TriadRecord | None
    averaging_time_s: float
    calibration: str | None = Field(description="Id of the current calibration")
    thermal_correction: str | None = Field(description="Id of the current correction of the kind `thermal`")
    converter: str | None = Field(description="Id of the current correction of the kind `converter`")

    @classmethod
    def of(cls, unit: Unit) -> "UnitView":
        return cls(
            serial=unit.serial,
            sample_rate_hz=unit.sample_rate_hz,
            channels=list(unit.channels),
            gyro=unit.gyro,
            accelerometer=unit.accelerometer,
            averaging_time_s=unit.averaging_time_s,
            calibration=unit.calibration_id,
            thermal_correction=unit.thermal_correction_id,
            converter=unit.converter_id,
        )


class Truth(BaseModel):
    """What a simulated unit really was in a job."""

    job: str
    triads: list[TrueTriad]
