"""SQL tables of evidence: units, recordings with their chunks, results, calibrations, corrections, and lineage."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, Float, ForeignKey, Index, LargeBinary, text
from sqlalchemy.orm import Mapped, mapped_column

from bench_service.persistence.tables.columns import Document, Id, Table, short_and_long

NAMES_JOIN = "\n"
OF_A_TREND = ("unit", "name", "simulated", "id", "job_id", "created_at", "code_version")
"""Columns of results that a trend is found by, and what it shows of them: behind the document they are slow to read."""


class UnitRow(Table):
    __tablename__ = "units"

    serial: Mapped[str] = mapped_column(Id, primary_key=True)
    document: Mapped[dict[str, Any]]
    updated_at: Mapped[datetime]


class UnitNoteRow(Table):
    """A remark of a person about a unit."""

    __tablename__ = "unit_notes"
    __table_args__ = (Index(None, "unit", "id"),)

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    unit: Mapped[str] = mapped_column(Id)
    at: Mapped[datetime]
    by: Mapped[str]
    proven: Mapped[bool]
    text: Mapped[str]


class RecordingRow(Table):
    __tablename__ = "recordings"
    __table_args__ = (
        Index("ix_recordings_job_id_id", "job_id", "id"),
        Index("ix_recordings_unit_id", "unit", "id"),
        Index("ix_recordings_state_stored_bytes", "state", "stored_bytes"),
        Index("ix_recordings_simulated_id", "simulated", "id"),
        Index("ix_recordings_bench_id", "bench", "id"),
        *short_and_long("recordings", "station_label"),
        *short_and_long("recordings", "file_names"),
        Index("ix_recordings_raw_state_stored_bytes", "raw", "state", "stored_bytes"),
        Index(
            "uq_recordings_complete_station",
            "job_id",
            "station_index",
            unique=True,
            sqlite_where=text("state = 'complete'"),
            postgresql_where=text("state = 'complete'"),
        ),
    )

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    unit: Mapped[str]
    bench: Mapped[str | None]
    job_id: Mapped[str | None] = mapped_column(Id, ForeignKey("jobs.id"))
    station_index: Mapped[int | None]
    station: Mapped[dict[str, Any] | None] = mapped_column(Document)
    station_label: Mapped[str | None]
    """Label of the station, for searches."""
    channels: Mapped[list[Any]]
    rate_hz: Mapped[float] = mapped_column(Float(53))
    start_s: Mapped[float] = mapped_column(Float(53))
    launched_s: Mapped[float | None] = mapped_column(Float(53))
    sample_type: Mapped[str]
    samples: Mapped[int] = mapped_column(BigInteger)
    chunk_rows: Mapped[int]
    chunks: Mapped[int]
    stored_bytes: Mapped[int] = mapped_column(BigInteger)
    content_hash: Mapped[str]
    simulated: Mapped[bool]
    state: Mapped[str]
    created_at: Mapped[datetime]
    source: Mapped[dict[str, Any]]
    file_names: Mapped[str | None]
    """Names of the files of an import, joined by `NAMES_JOIN`, to be searched."""
    checkpoint: Mapped[dict[str, Any] | None] = mapped_column(Document, deferred=True)
    """State of the simulated world after it: long, and not read with a list."""
    measured: Mapped[dict[str, Any] | None] = mapped_column(Document)
    raw: Mapped[str] = mapped_column(server_default="stored")
    raw_changed_at: Mapped[datetime | None]
    archive: Mapped[str | None]


class ChunkRow(Table):
    __tablename__ = "chunks"

    recording_id: Mapped[str] = mapped_column(Id, ForeignKey("recordings.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    start_sample: Mapped[int] = mapped_column(BigInteger)
    samples: Mapped[int]
    sha256: Mapped[str]
    payload: Mapped[bytes] = mapped_column(LargeBinary)
    """The chunk's bytes; empty once they are in the archive or removed, see the recording's `raw`."""


class HoldRow(Table):
    """A person's hold on the raw data of a recording."""

    __tablename__ = "recording_holds"
    __table_args__ = (Index("ix_recording_holds_recording_id", "recording_id"),)

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    recording_id: Mapped[str] = mapped_column(Id, ForeignKey("recordings.id"))
    reason: Mapped[str]
    by: Mapped[str]
    held_at: Mapped[datetime]
    released_at: Mapped[datetime | None]
    released_by: Mapped[str]


class ResultRow(Table):
    __tablename__ = "results"
    __table_args__ = (
        Index("ix_results_job_id_id", "job_id", "id"),
        Index("ix_results_unit_id", "unit", "id"),
        Index("ix_results_name_id", "name", "id"),
        Index("ix_results_verdict_id", "verdict", "id"),
        Index("ix_results_id_name_unit_job_id", "id", "name", "unit", "job_id"),
        Index("ix_results_unit_name_simulated_id", *OF_A_TREND),
    )

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    kind: Mapped[str]
    name: Mapped[str]
    version: Mapped[str]
    parameters: Mapped[dict[str, Any]]
    document: Mapped[dict[str, Any]]
    verdict: Mapped[str]
    code_version: Mapped[str]
    simulated: Mapped[bool]
    created_at: Mapped[datetime]
    unit: Mapped[str | None]
    job_id: Mapped[str | None] = mapped_column(Id, ForeignKey("jobs.id"))
    seed: Mapped[int | None] = mapped_column(BigInteger)
    context: Mapped[dict[str, Any]]


class ResultRecordingRow(Table):
    __tablename__ = "result_recordings"
    __table_args__ = (Index("ix_result_recordings_recording_id", "recording_id"),)

    result_id: Mapped[str] = mapped_column(Id, ForeignKey("results.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    recording_id: Mapped[str] = mapped_column(Id, ForeignKey("recordings.id"))
    content_hash: Mapped[str]


class ResultQuantityRow(Table):
    """A quantity of a result by name, copied from its document: a trend over many results reads no document.

    Coefficients of the result's own calibrations are not here, but in `coefficients`.
    """

    __tablename__ = "result_quantities"

    result_id: Mapped[str] = mapped_column(Id, ForeignKey("results.id"), primary_key=True)
    name: Mapped[str] = mapped_column(Id, primary_key=True)
    value: Mapped[float] = mapped_column(Float(53))
    unit: Mapped[str]
    standard_uncertainty: Mapped[float | None] = mapped_column(Float(53))


class CalibrationRow(Table):
    """A calibration of one triad, without its coefficients; at most one of each triad of a unit is current."""

    __tablename__ = "calibrations"
    __table_args__ = (
        Index("ix_calibrations_unit_id", "unit", "id"),
        Index("uq_calibrations_result_triad", "result_id", "triad", unique=True),
        Index(
            "uq_calibrations_current_unit_triad",
            "unit",
            "triad",
            unique=True,
            sqlite_where=text("is_current"),
            postgresql_where=text("is_current"),
        ),
    )

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    unit: Mapped[str]
    triad: Mapped[str]
    method: Mapped[str]
    origin: Mapped[str]
    result_id: Mapped[str | None] = mapped_column(Id, ForeignKey("results.id"))
    made_at: Mapped[datetime]
    simulated: Mapped[bool]
    output_unit: Mapped[str]
    input_unit: Mapped[str]
    model: Mapped[str]
    correlations: Mapped[list[Any]]
    is_current: Mapped[bool]
    by_rule: Mapped[bool]
    approval: Mapped[str]
    valid_from: Mapped[datetime | None]
    valid_until: Mapped[datetime | None]


class CoefficientRow(Table):
    """A coefficient of a calibration: the one place where its value and its standard uncertainty are stored."""

    __tablename__ = "coefficients"

    calibration_id: Mapped[str] = mapped_column(Id, ForeignKey("calibrations.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    name: Mapped[str]
    value: Mapped[float] = mapped_column(Float(53))
    unit: Mapped[str]
    standard_uncertainty: Mapped[float] = mapped_column(Float(53))


class CalibrationDecisionRow(Table):
    """A decision about a calibration; rows are added, and never changed or removed."""

    __tablename__ = "calibration_decisions"
    __table_args__ = (Index("ix_calibration_decisions_calibration_id_id", "calibration_id", "id"),)

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    calibration_id: Mapped[str] = mapped_column(Id, ForeignKey("calibrations.id"))
    act: Mapped[str]
    at: Mapped[datetime]
    by: Mapped[str]
    proven: Mapped[bool]
    remark: Mapped[str]


class ResultCalibrationRow(Table):
    __tablename__ = "result_calibrations"
    __table_args__ = (Index("ix_result_calibrations_calibration_id", "calibration_id"),)

    result_id: Mapped[str] = mapped_column(Id, ForeignKey("results.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    calibration_id: Mapped[str] = mapped_column(Id, ForeignKey("calibrations.id"))


class CorrectionRow(Table):
    """A correction set of a unit, of the kind "thermal", "converter", "thermometers" or "gyros"; at most one of a kind
    is current.
    """

    __tablename__ = "corrections"
    __table_args__ = (
        Index("ix_corrections_unit_id", "unit", "id"),
        Index(
            "uq_corrections_current_unit_kind",
            "unit",
            "kind",
            unique=True,
            sqlite_where=text("is_current"),
            postgresql_where=text("is_current"),
        ),
    )

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    unit: Mapped[str]
    kind: Mapped[str]
    result_id: Mapped[str] = mapped_column(Id, ForeignKey("results.id"))
    made_at: Mapped[datetime]
    is_current: Mapped[bool]
    simulated: Mapped[bool]
    document: Mapped[dict[str, Any]]
    approval: Mapped[str] = mapped_column(server_default="open")
    valid_until: Mapped[datetime | None]


class CorrectionDecisionRow(Table):
    """A decision about a correction set; rows are added, and never changed or removed."""

    __tablename__ = "correction_decisions"
    __table_args__ = (Index("ix_correction_decisions_correction_id_id", "correction_id", "id"),)

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    correction_id: Mapped[str] = mapped_column(Id, ForeignKey("corrections.id"))
    act: Mapped[str]
    at: Mapped[datetime]
    by: Mapped[str]
    proven: Mapped[bool]
    remark: Mapped[str]


class ResultCorrectionRow(Table):
    """A correction set that a result used, by its position among them."""

    __tablename__ = "result_corrections"
    __table_args__ = (Index("ix_result_corrections_correction_id", "correction_id"),)

    result_id: Mapped[str] = mapped_column(Id, ForeignKey("results.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    correction_id: Mapped[str] = mapped_column(Id, ForeignKey("corrections.id"))
