"""mountings of units on benches, and the one that a job names

Revision: 0012, after 0011
"""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.create_table(
        "mountings",
        sa.Column("id", ID, nullable=False),
        sa.Column("unit", ID, nullable=False),
        sa.Column("bench", ID, nullable=False),
        sa.Column("plate", sa.String(), nullable=False),
        sa.Column("by", sa.String(), nullable=False),
        sa.Column("proven", sa.Boolean(), nullable=False),
        sa.Column("mounted_at", MOMENT, nullable=False),
        sa.Column("entered_at", MOMENT, nullable=False),
        sa.Column("azimuth_deg", sa.Float(53), nullable=False),
        sa.Column("azimuth_sd_arcsec", sa.Float(53), nullable=False),
        sa.Column("instrument", sa.String(), nullable=False),
        sa.Column("remark", sa.String(), nullable=False),
        sa.Column("ended_at", MOMENT, nullable=True),
        sa.Column("ended_by", sa.String(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_mountings")),
    )
    op.create_index("ix_mountings_bench_id", "mountings", ["bench", "id"])
    op.create_index("ix_mountings_unit_id", "mountings", ["unit", "id"])
    op.add_column("jobs", sa.Column("mounting", ID, nullable=True))


def downgrade() -> None:
    op.drop_table("mountings")
    op.drop_column("jobs", "mounting")  # in place: jobs made anew would be dropped under the rows that name them
