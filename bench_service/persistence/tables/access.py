"""SQL tables of access: accounts, tokens, sessions, failed log-ins, approvals, and the count of their changes."""

from datetime import datetime

from sqlalchemy import Index
from sqlalchemy.orm import Mapped, mapped_column

from bench_service.persistence.tables.columns import Id, Table


class AccessStateRow(Table):
    """The single row that counts changes of access, with the key of the values against cross-site requests."""

    __tablename__ = "access_state"

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    revision: Mapped[int]
    key: Mapped[str]


class AccountRow(Table):
    __tablename__ = "accounts"

    name: Mapped[str] = mapped_column(Id, primary_key=True)
    role: Mapped[str]
    team: Mapped[str]
    password: Mapped[str | None]
    """Hash of the password with its parameters; NULL for an account that only a proxy authenticates."""
    created_at: Mapped[datetime]
    created_by: Mapped[str]


class TokenRow(Table):
    """A token: its secret is not here, only its digest."""

    __tablename__ = "tokens"
    __table_args__ = (Index(None, "digest", unique=True), Index(None, "name"))

    id: Mapped[str] = mapped_column(Id, primary_key=True)
    name: Mapped[str] = mapped_column(Id)
    role: Mapped[str]
    team: Mapped[str]
    digest: Mapped[str] = mapped_column(Id)
    created_at: Mapped[datetime]
    created_by: Mapped[str]
    expires_at: Mapped[datetime]
    revoked_at: Mapped[datetime | None]
    last_used_at: Mapped[datetime | None]


class SessionRow(Table):
    """A person's session that nobody has ended; it expires by its times."""

    __tablename__ = "sessions"
    __table_args__ = (Index(None, "account"),)

    digest: Mapped[str] = mapped_column(Id, primary_key=True)
    account: Mapped[str] = mapped_column(Id)
    created_at: Mapped[datetime]
    last_used_at: Mapped[datetime]


class FailedLogInRow(Table):
    """Failed log-ins in a row under one name, also under a name that nobody has."""

    __tablename__ = "failed_log_ins"

    name: Mapped[str] = mapped_column(Id, primary_key=True)
    failures: Mapped[int]
    last_at: Mapped[datetime]


class ApprovalRow(Table):
    """The version of a procedure that operators may run, with who approved it and when."""

    __tablename__ = "approvals"

    procedure: Mapped[str] = mapped_column(Id, primary_key=True)
    version: Mapped[str]
    by: Mapped[str]
    at: Mapped[datetime]
