"""SQL tables of campaigns, their runs and schedules."""

from datetime import datetime
from typing import Any

from sqlalchemy import Index
from sqlalchemy.orm import Mapped, mapped_column

from bench_service.persistence.tables.columns import Id, Table


class CampaignRow(Table):
    """A stored campaign, as a JSON document with its team and times."""

    __tablename__ = "campaigns"

    name: Mapped[str] = mapped_column(Id, primary_key=True)
    team: Mapped[str] = mapped_column(server_default="")
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
    """A schedule by which a campaign starts, as a JSON document with its next start."""

    __tablename__ = "schedules"

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    campaign: Mapped[str] = mapped_column(Id)
    enabled: Mapped[bool]
    created_at: Mapped[datetime]
    next_at: Mapped[datetime | None]
    last_at: Mapped[datetime | None]
    document: Mapped[dict[str, Any]]
