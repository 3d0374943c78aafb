"""SQL tables of benches: as registered, their stops, their live state, mountings of units."""

from datetime import datetime
from typing import Any

from sqlalchemy import Float, Index, text
from sqlalchemy.orm import Mapped, mapped_column

from bench_service.persistence.tables.columns import Id, Table


class BenchRow(Table):
    __tablename__ = "benches"

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    document: Mapped[dict[str, Any]]
    updated_at: Mapped[datetime]


class BenchStopRow(Table):
    """A stop of a bench; it stands while `released_at` is empty."""

    __tablename__ = "bench_stops"
    __table_args__ = (
        Index(None, "bench", "id"),
        Index(
            "ix_bench_stops_standing",
            "bench",
            sqlite_where=text("released_at IS NULL"),
            postgresql_where=text("released_at IS NULL"),
        ),
    )

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    bench: Mapped[str] = mapped_column(Id)
    at: Mapped[datetime]
    reason: Mapped[str]
    by: Mapped[str]
    safe_at: Mapped[datetime | None]
    safe_by: Mapped[str]
    released_at: Mapped[datetime | None]
    released_by: Mapped[str]
    remark: Mapped[str]
    entered_at: Mapped[datetime | None]


class BenchLiveRow(Table):
    """The last live state that a bench's driver reported, one row a bench."""

    __tablename__ = "bench_live"

    bench: Mapped[str] = mapped_column(Id, primary_key=True)
    at: Mapped[datetime]
    host: Mapped[str]
    process: Mapped[int]
    job_id: Mapped[str | None] = mapped_column(Id)
    document: Mapped[dict[str, Any]]


class MountingRow(Table):
    """A unit on a plate of a bench; it stands while `ended_at` is empty."""

    __tablename__ = "mountings"
    __table_args__ = (Index(None, "bench", "id"), Index(None, "unit", "id"))

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    unit: Mapped[str] = mapped_column(Id)
    bench: Mapped[str] = mapped_column(Id)
    plate: Mapped[str]
    by: Mapped[str]
    proven: Mapped[bool]
    mounted_at: Mapped[datetime]
    entered_at: Mapped[datetime]
    azimuth_deg: Mapped[float] = mapped_column(Float(53))
    azimuth_sd_arcsec: Mapped[float] = mapped_column(Float(53))
    instrument: Mapped[str]
    remark: Mapped[str]
    ended_at: Mapped[datetime | None]
    ended_by: Mapped[str]
