"""the order of a bench's queue as an index, so that its first jobs are found without reading the others

Revision: 0006, after 0005
"""

from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("UPDATE jobs SET queued_at = created_at WHERE queued_at IS NULL")
    op.create_index(
        "ix_jobs_bench_state_priority_queued_at_id", "jobs", ["bench", "state", "priority", "queued_at", "id"]
    )
    op.drop_index("ix_jobs_bench_state", table_name="jobs")


def downgrade() -> None:
    op.create_index("ix_jobs_bench_state", "jobs", ["bench", "state"])
    op.drop_index("ix_jobs_bench_state_priority_queued_at_id", table_name="jobs")
