"""leases of manual mode without a team: their rights follow the reservation's

Revision: 0022, after 0021
"""

import sqlalchemy as sa
from alembic import op

revision = "0022"
down_revision = "0021"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.drop_column("manual_leases", "team")


def downgrade() -> None:
    op.add_column("manual_leases", sa.Column("team", sa.String(), nullable=False, server_default=""))
