"""accounts, tokens, sessions, approvals; the team of a reservation; the audit trail as a hash chain

Revision: 0009, after 0008

Entries of the trail that exist are chained as they stand: from here on a change of them shows.
"""

import hashlib
import json
import secrets
from datetime import UTC, datetime

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
MOMENT = sa.DateTime(timezone=True)
AT_ONCE = 1000


def upgrade() -> None:
    _make_tables()
    op.add_column("reservations", sa.Column("team", sa.String(), nullable=False, server_default=""))
    op.add_column("audit", sa.Column("sequence", sa.BigInteger(), nullable=True))
    op.add_column("audit", sa.Column("digest", sa.String(), nullable=True))
    _chain()
    op.create_index(op.f("ix_audit_sequence"), "audit", ["sequence"], unique=True)


def downgrade() -> None:
    op.drop_index(op.f("ix_audit_sequence"), "audit")
    with op.batch_alter_table("audit") as batch:
        batch.drop_column("digest")
        batch.drop_column("sequence")
    with op.batch_alter_table("reservations") as batch:
        batch.drop_column("team")
    for table in ("audit_checkpoints", "approvals", "failed_log_ins", "sessions", "tokens", "accounts", "access_state"):
        op.drop_table(table)


def _table(name: str, key: str, *columns: sa.Column[object]) -> sa.Table:
    return op.create_table(name, *columns, sa.PrimaryKeyConstraint(key, name=op.f(f"pk_{name}")))


def _text(name: str, nullable: bool = False) -> sa.Column[object]:
    return sa.Column(name, sa.String(), nullable=nullable)


def _id(name: str) -> sa.Column[object]:
    return sa.Column(name, ID, nullable=False)


def _moment(name: str, nullable: bool = False) -> sa.Column[object]:
    return sa.Column(name, MOMENT, nullable=nullable)


def _number(name: str, kind: type[sa.Integer] = sa.Integer) -> sa.Column[object]:
    return sa.Column(name, kind(), nullable=False, autoincrement=False)


def _make_tables() -> None:
    state = _table("access_state", "id", _id("id"), _number("revision"), _text("key"))
    op.bulk_insert(state, [{"id": "access", "revision": 0, "key": secrets.token_hex(32)}])
    _table(
        "accounts",
        "name",
        _id("name"),
        _text("role"),
        _text("team"),
        _text("password", nullable=True),
        _moment("created_at"),
        _text("created_by"),
    )
    _table(
        "tokens",
        "id",
        _id("id"),
        _id("name"),
        _text("role"),
        _text("team"),
        _id("digest"),
        _moment("created_at"),
        _text("created_by"),
        _moment("expires_at"),
        _moment("revoked_at", nullable=True),
        _moment("last_used_at", nullable=True),
    )
    op.create_index(op.f("ix_tokens_digest"), "tokens", ["digest"], unique=True)
    op.create_index(op.f("ix_tokens_name"), "tokens", ["name"])
    _table("sessions", "digest", _id("digest"), _id("account"), _moment("created_at"), _moment("last_used_at"))
    op.create_index(op.f("ix_sessions_account"), "sessions", ["account"])
    _table("failed_log_ins", "name", _id("name"), _number("failures"), _moment("last_at"))
    _table("approvals", "procedure", _id("procedure"), _text("version"), _text("by"), _moment("at"))
    _table(
        "audit_checkpoints",
        "last",
        _number("last", sa.BigInteger),
        _number("first", sa.BigInteger),
        _moment("first_at"),
        _moment("last_at"),
        _text("before"),
        _text("digest"),
        _moment("closed_at"),
        _text("closed_by"),
    )


def _chain() -> None:
    """Number the entries in the order of their ids, and give each the digest of itself and of the one before."""
    connection = op.get_bind()
    columns = "id, at, who, action, target, outcome, CAST(detail AS TEXT) AS detail"
    read = sa.text(f"SELECT {columns} FROM audit WHERE id > :after ORDER BY id LIMIT :most").columns(at=MOMENT)
    write = sa.text("UPDATE audit SET sequence = :sequence, digest = :digest WHERE id = :id")
    sequence, digest, after = 0, "0" * 64, ""
    while rows := connection.execute(read, {"after": after, "most": AT_ONCE}).all():
        changes: list[dict[str, object]] = []
        for row in rows:
            sequence += 1
            moment = [sequence, row.id, _utc(row.at), row.who, row.action, row.target, row.outcome, row.detail]
            digest = hashlib.sha256(f"{digest}\n{json.dumps(moment)}".encode()).hexdigest()
            changes.append({"sequence": sequence, "digest": digest, "id": row.id})
        connection.execute(write, changes)
        after = rows[-1].id


def _utc(at: datetime) -> str:
    moment = at.replace(tzinfo=UTC) if at.tzinfo is None else at.astimezone(UTC)
    return moment.isoformat(timespec="microseconds")
