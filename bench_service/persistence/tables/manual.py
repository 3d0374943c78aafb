"""SQL tables of manual mode: leases, and the demands that were made under them."""

from datetime import datetime
from typing import Any

from sqlalchemy import Index, UniqueConstraint, text
from sqlalchemy.orm import Mapped, mapped_column

from bench_service.persistence.tables.columns import Document, Id, Table


class ManualLeaseRow(Table):
    """A lease of manual mode on a bench; at most one of a bench is open."""

    __tablename__ = "manual_leases"
    __table_args__ = (
        Index(None, "bench", "id"),
        Index(
            "ix_manual_leases_open",
            "bench",
            unique=True,
            sqlite_where=text("ended_at IS NULL"),
            postgresql_where=text("ended_at IS NULL"),
        ),
    )

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    bench: Mapped[str] = mapped_column(Id)
    unit: Mapped[str] = mapped_column(Id)
    holder: Mapped[str]
    proven: Mapped[bool]
    reason: Mapped[str]
    created_at: Mapped[datetime]
    until: Mapped[datetime]
    reservation: Mapped[str | None] = mapped_column(Id)
    began_at: Mapped[datetime | None]
    process: Mapped[str]
    heard: Mapped[int]
    end_asked: Mapped[str]
    ended_at: Mapped[datetime | None]
    ended_because: Mapped[str]
    safe: Mapped[bool | None]


class ManualDemandRow(Table):
    """A demand that was made under a lease of manual mode, with its state and answer."""

    __tablename__ = "manual_demands"
    __table_args__ = (UniqueConstraint("lease", "key"), Index(None, "lease", "id"))

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    lease: Mapped[str] = mapped_column(Id)
    key: Mapped[str]
    kind: Mapped[str]
    values: Mapped[dict[str, Any]]
    by: Mapped[str]
    at: Mapped[datetime]
    state: Mapped[str]
    answer: Mapped[dict[str, Any]] = mapped_column(Document)
    ended_at: Mapped[datetime | None]
