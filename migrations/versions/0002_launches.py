"""when the unit of a recording was switched on

Revision: 0002, after 0001
"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("recordings", sa.Column("launched_s", sa.Float(precision=53), nullable=True))


def downgrade() -> None:
    op.drop_column("recordings", "launched_s")
