"""SQL tables of benches: as registered, their stops, their live state."""

from datetime import datetime
from typing import Any

from sqlalchemy import Index, text
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


class BenchLiveRow(Table):
    """Last live state that a bench's driver reported."""

    __tablename__ = "bench_live"

    bench: Mapped[str] = mapped_column(Id, primary_key=True)
    at: Mapped[datetime]
    host: Mapped[str]
    process: Mapped[int]
    job_id: Mapped[str | None] = mapped_column(Id)
    document: Mapped[dict[str, Any]]
