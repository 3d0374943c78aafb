"""teams of campaigns and of their jobs; the moment at which a stop was entered

Revision: 0014, after 0013
"""

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("campaigns", sa.Column("team", sa.String(), nullable=False, server_default=""))
    op.add_column("jobs", sa.Column("team", sa.String(), nullable=False, server_default=""))
    op.add_column("bench_stops", sa.Column("entered_at", sa.DateTime(timezone=True), nullable=True))


def downgrade() -> None:
    op.drop_column("bench_stops", "entered_at")
    op.drop_column("jobs", "team")
    op.drop_column("campaigns", "team")
