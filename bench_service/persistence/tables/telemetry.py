"""SQL tables of the audit trail and of the reports of upkeep."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, Index
from sqlalchemy.orm import Mapped, mapped_column

from bench_service.persistence.tables.columns import Id, Table


class AuditRow(Table):
    """One entry of the audit trail: client, request and outcome, and its place in the chain."""

    __tablename__ = "audit"
    __table_args__ = (Index(None, "sequence", unique=True),)

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    at: Mapped[datetime]
    who: Mapped[str]
    action: Mapped[str]
    target: Mapped[str]
    outcome: Mapped[str]
    detail: Mapped[dict[str, Any]]
    sequence: Mapped[int] = mapped_column(BigInteger, nullable=True)
    """Place in the chain, never NULL; to declare that in an existing table, SQLite would have to copy it."""
    digest: Mapped[str] = mapped_column(nullable=True)


class AuditCheckpointRow(Table):
    """A stretch of the chain whose entries were removed when their retention ended."""

    __tablename__ = "audit_checkpoints"

    last: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    first: Mapped[int] = mapped_column(BigInteger)
    first_at: Mapped[datetime]
    last_at: Mapped[datetime]
    before: Mapped[str]
    digest: Mapped[str]
    closed_at: Mapped[datetime]
    closed_by: Mapped[str]


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
