"""SQL tables of the audit trail and of the reports of upkeep."""

from datetime import datetime
from typing import Any

from sqlalchemy import Index
from sqlalchemy.orm import Mapped, mapped_column

from bench_service.persistence.tables.columns import Id, Table


class AuditRow(Table):
    """One entry of the audit trail: client, request and outcome."""

    __tablename__ = "audit"

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    at: Mapped[datetime]
    who: Mapped[str]
    action: Mapped[str]
    target: Mapped[str]
    outcome: Mapped[str]
    detail: Mapped[dict[str, Any]]


class UpkeepRow(Table):
    """A check of the database, or a copy of it, and its outcome."""

    __tablename__ = "upkeep"
    __table_args__ = (Index("ix_upkeep_kind_id", "kind", "id"),)

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    kind: Mapped[str]
    began_at: Mapped[datetime]
    ended_at: Mapped[datetime | None]
    by: Mapped[str]
    good: Mapped[bool | None]
    document: Mapped[dict[str, Any]]
