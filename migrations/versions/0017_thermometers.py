"""approval and validity of correction sets, and what people decided about them

Revision: 0017, after 0016
"""

import sqlalchemy as sa
from alembic import op

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.add_column("corrections", sa.Column("approval", sa.String(), nullable=False, server_default="open"))
    op.add_column("corrections", sa.Column("valid_until", MOMENT, nullable=True))
    op.create_table(
        "correction_decisions",
        sa.Column("id", ID, nullable=False),
        sa.Column("correction_id", ID, nullable=False),
        sa.Column("act", sa.String(), nullable=False),
        sa.Column("at", MOMENT, nullable=False),
        sa.Column("by", sa.String(), nullable=False),
        sa.Column("proven", sa.Boolean(), nullable=False),
        sa.Column("remark", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(
            ["correction_id"], ["corrections.id"], name=op.f("fk_correction_decisions_correction_id_corrections")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_correction_decisions")),
    )
    op.create_index("ix_correction_decisions_correction_id_id", "correction_decisions", ["correction_id", "id"])


def downgrade() -> None:
    op.drop_table("correction_decisions")
    op.drop_column("corrections", "valid_until")
    op.drop_column("corrections", "approval")
