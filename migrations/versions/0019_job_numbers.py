"""short numbers of jobs, counted from 1 in each database

Revision: 0019, after 0018
"""

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("jobs", sa.Column("number", sa.Integer(), nullable=True))
    op.execute(
        "UPDATE jobs SET number = counted.n FROM "
        "(SELECT id, row_number() OVER (ORDER BY created_at, id) AS n FROM jobs) AS counted WHERE counted.id = jobs.id"
    )
    op.create_index("ix_jobs_number", "jobs", ["number"], unique=True)


def downgrade() -> None:
    op.drop_index("ix_jobs_number", table_name="jobs")
    op.drop_column("jobs", "number")  # in place: jobs made anew would be dropped under the rows that name them
