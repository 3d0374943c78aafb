"""each stop of a bench as a row of its own, kept after its release

Revision: 0007, after 0006
"""

import secrets
from datetime import UTC, datetime
from uuid import UUID

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
MOMENT = sa.DateTime(timezone=True)
STANDS = "released_at IS NULL"


def upgrade() -> None:
    standing = _rows("SELECT bench, at, reason, safe_at, safe_by FROM bench_stops")
    op.drop_table("bench_stops")  # SQLite cannot change a primary key; at most one row a bench is carried over
    stops = op.create_table(
        "bench_stops",
        sa.Column("id", ID, nullable=False),
        sa.Column("bench", ID, nullable=False),
        sa.Column("at", MOMENT, nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
        sa.Column("by", sa.String(), nullable=False),
        sa.Column("safe_at", MOMENT, nullable=True),
        sa.Column("safe_by", sa.String(), nullable=False),
        sa.Column("released_at", MOMENT, nullable=True),
        sa.Column("released_by", sa.String(), nullable=False),
        sa.Column("remark", sa.String(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_bench_stops")),
    )
    op.create_index("ix_bench_stops_bench_id", "bench_stops", ["bench", "id"])
    op.create_index(
        "ix_bench_stops_standing",
        "bench_stops",
        ["bench"],
        sqlite_where=sa.text(STANDS),
        postgresql_where=sa.text(STANDS),
    )
    added = {"by": "", "released_at": None, "released_by": "", "remark": ""}
    op.bulk_insert(stops, [{**row, **added, "id": _id_of(row["at"])} for row in standing])


def downgrade() -> None:
    standing = _rows(f"SELECT bench, at, reason, safe_at, safe_by FROM bench_stops WHERE {STANDS} ORDER BY at DESC, id")
    op.drop_table("bench_stops")
    stops = op.create_table(
        "bench_stops",
        sa.Column("bench", ID, nullable=False),
        sa.Column("at", MOMENT, nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
        sa.Column("safe_at", MOMENT, nullable=True),
        sa.Column("safe_by", sa.String(), nullable=False, server_default=""),
        sa.PrimaryKeyConstraint("bench", name=op.f("pk_bench_stops")),
    )
    op.bulk_insert(stops, list({row["bench"]: row for row in standing}.values()))  # of each bench its oldest


def _rows(query: str) -> list[dict[str, object]]:
    read = sa.text(query).columns(bench=sa.String, at=MOMENT, reason=sa.String, safe_at=MOMENT, safe_by=sa.String)
    return [dict(row) for row in op.get_bind().execute(read).mappings()]


def _id_of(at: object) -> str:
    """A UUID of version 7 made at a moment; SQLite returns moments without their zone, which is UTC."""
    assert isinstance(at, datetime)
    moment = at if at.tzinfo is not None else at.replace(tzinfo=UTC)
    milliseconds = int(moment.timestamp() * 1000)
    bits = (milliseconds << 80) | secrets.randbits(80)
    bits = (bits & ~(0xF << 76)) | (0x7 << 76)
    bits = (bits & ~(0x3 << 62)) | (0x2 << 62)
    return str(UUID(int=bits))
