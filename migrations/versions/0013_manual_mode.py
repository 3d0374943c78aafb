"""leases of manual mode, and their demands

Revision: 0013, after 0012
"""

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.create_table(
        "manual_leases",
        sa.Column("id", ID, nullable=False),
        sa.Column("bench", ID, nullable=False),
        sa.Column("unit", ID, nullable=False),
        sa.Column("holder", sa.String(), nullable=False),
        sa.Column("proven", sa.Boolean(), nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("until", MOMENT, nullable=False),
        sa.Column("team", sa.String(), nullable=False),
        sa.Column("reservation", ID, nullable=True),
        sa.Column("began_at", MOMENT, nullable=True),
        sa.Column("process", sa.String(), nullable=False),
        sa.Column("heard", sa.Integer(), nullable=False),
        sa.Column("end_asked", sa.String(), nullable=False),
        sa.Column("ended_at", MOMENT, nullable=True),
        sa.Column("ended_because", sa.String(), nullable=False),
        sa.Column("safe", sa.Boolean(), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_manual_leases")),
    )
    op.create_index("ix_manual_leases_bench_id", "manual_leases", ["bench", "id"])
    op.create_index(
        "ix_manual_leases_open",
        "manual_leases",
        ["bench"],
        unique=True,
        sqlite_where=sa.text("ended_at IS NULL"),
        postgresql_where=sa.text("ended_at IS NULL"),
    )
    op.create_table(
        "manual_demands",
        sa.Column("id", ID, nullable=False),
        sa.Column("lease", ID, nullable=False),
        sa.Column("key", sa.String(), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("values", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("by", sa.String(), nullable=False),
        sa.Column("at", MOMENT, nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("answer", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("ended_at", MOMENT, nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_manual_demands")),
        sa.UniqueConstraint("lease", "key", name=op.f("uq_manual_demands_lease_key")),
    )
    op.create_index("ix_manual_demands_lease_id", "manual_demands", ["lease", "id"])


def downgrade() -> None:
    op.drop_table("manual_demands")
    op.drop_table("manual_leases")
