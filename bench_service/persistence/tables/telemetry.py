"""SQL table of the audit trail."""

from datetime import datetime
from typing import Any

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
