"""pausing, resuming and deadlines of jobs; benches that stay stopped

Revision: 0003, after 0002
"""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    # Defaults are for the rows that exist; new ones say what they are.
    op.add_column("jobs", sa.Column("pause_requested", sa.Boolean(), nullable=False, server_default=sa.false()))
    op.add_column("jobs", sa.Column("attempt", sa.Integer(), nullable=False, server_default="1"))
    op.add_column("jobs", sa.Column("deadline_at", MOMENT, nullable=True))
    op.create_table(
        "bench_stops",
        sa.Column("bench", ID, nullable=False),
        sa.Column("at", MOMENT, nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
        sa.PrimaryKeyConstraint("bench", name=op.f("pk_bench_stops")),
    )


def downgrade() -> None:
    op.drop_table("bench_stops")
    op.drop_column("jobs", "deadline_at")
    op.drop_column("jobs", "attempt")
    op.drop_column("jobs", "pause_requested")
