"""The tables around jobs: reservations, live state, audit, campaigns and schedules, corrections.

See `tables` for the manner.
"""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, text
from sqlalchemy.orm import Mapped, mapped_column

from bench_service.persistence.tables import Id, Table

__all__ = [
    "AuditRow",
    "BenchLiveRow",
    "CampaignRow",
    "CampaignRunRow",
    "CorrectionRow",
    "ReservationRow",
    "ResultCorrectionRow",
    "ScheduleRow",
    "Table",
]


class ReservationRow(Table):
    """A unit or a bench that somebody keeps for a while."""

    __tablename__ = "reservations"
    __table_args__ = (Index("ix_reservations_kind_name", "kind", "name"),)

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    kind: Mapped[str]
    name: Mapped[str] = mapped_column(Id)
    holder: Mapped[str]
    note: Mapped[str]
    created_at: Mapped[datetime]
    until: Mapped[datetime]
    ended_at: Mapped[datetime | None]


class BenchLiveRow(Table):
    """The last that a bench's driver said of it."""

    __tablename__ = "bench_live"

    bench: Mapped[str] = mapped_column(Id, primary_key=True)
    at: Mapped[datetime]
    host: Mapped[str]
    process: Mapped[int]
    job_id: Mapped[str | None] = mapped_column(Id)
    document: Mapped[dict[str, Any]]


class AuditRow(Table):
    """Who asked what, and what became of it."""

    __tablename__ = "audit"

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    at: Mapped[datetime]
    who: Mapped[str]
    action: Mapped[str]
    target: Mapped[str]
    outcome: Mapped[str]
    detail: Mapped[dict[str, Any]]


class CampaignRow(Table):
    """A campaign as data."""

    __tablename__ = "campaigns"

    name: Mapped[str] = mapped_column(Id, primary_key=True)
    document: Mapped[dict[str, Any]]
    created_at: Mapped[datetime]
    updated_at: Mapped[datetime]


class CampaignRunRow(Table):
    """One execution of a campaign on one unit, with the campaign as it was then."""

    __tablename__ = "campaign_runs"
    __table_args__ = (
        Index("ix_campaign_runs_campaign_id", "campaign", "id"),
        Index("ix_campaign_runs_state_id", "state", "id"),
    )

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    campaign: Mapped[str] = mapped_column(Id)
    unit: Mapped[str]
    bench: Mapped[str] = mapped_column(Id)
    state: Mapped[str]
    verdict: Mapped[str | None]
    created_at: Mapped[datetime]
    finished_at: Mapped[datetime | None]
    schedule_id: Mapped[str | None] = mapped_column(Id)
    document: Mapped[dict[str, Any]]


class ScheduleRow(Table):
    """When a campaign is to start by itself."""

    __tablename__ = "schedules"

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    campaign: Mapped[str] = mapped_column(Id)
    enabled: Mapped[bool]
    created_at: Mapped[datetime]
    next_at: Mapped[datetime | None]
    last_at: Mapped[datetime | None]
    document: Mapped[dict[str, Any]]


class CorrectionRow(Table):
    """A correction set of a unit, of the kind "thermal" or "converter"; one of a kind is current."""

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


class ResultCorrectionRow(Table):
    """Which correction sets a result used."""

    __tablename__ = "result_corrections"
    __table_args__ = (Index("ix_result_corrections_correction_id", "correction_id"),)

    result_id: Mapped[str] = mapped_column(Id, ForeignKey("results.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    correction_id: Mapped[str] = mapped_column(Id, ForeignKey("corrections.id"))
