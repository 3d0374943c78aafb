"""batches of analyses, their tasks, and results by the content that they were made from

Revision: 0015, after 0014
"""

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.create_table(
        "analysis_batches",
        sa.Column("id", ID, nullable=False),
        sa.Column("method", sa.String(), nullable=False),
        sa.Column("version", sa.String(), nullable=False),
        sa.Column("parameters", sa.JSON(), nullable=False),
        sa.Column("calibrations", sa.JSON(), nullable=False),
        sa.Column("selection", sa.JSON(), nullable=False),
        sa.Column("each", sa.String(), nullable=False),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("requested_by", sa.String(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("total", sa.Integer(), nullable=False),
        sa.Column("cancelled_at", MOMENT, nullable=True),
        sa.Column("cancelled_by", sa.String(), nullable=False),
        sa.Column("ended_at", MOMENT, nullable=True),
        sa.Column("final_counts", sa.JSON(), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_analysis_batches")),
    )
    op.create_table(
        "analysis_tasks",
        sa.Column("batch_id", ID, nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("worker", sa.String(), nullable=False),
        sa.Column("claimed_at", MOMENT, nullable=True),
        sa.Column("ended_at", MOMENT, nullable=True),
        sa.Column("not_before", MOMENT, nullable=True),
        sa.Column("result_id", ID, nullable=True),
        sa.Column("failure", sa.JSON(), nullable=True),
        sa.ForeignKeyConstraint(
            ["batch_id"], ["analysis_batches.id"], name=op.f("fk_analysis_tasks_batch_id_analysis_batches")
        ),
        sa.ForeignKeyConstraint(["result_id"], ["results.id"], name=op.f("fk_analysis_tasks_result_id_results")),
        sa.PrimaryKeyConstraint("batch_id", "number", name=op.f("pk_analysis_tasks")),
    )
    op.create_index(
        "ix_analysis_tasks_state_priority_batch_id_number",
        "analysis_tasks",
        ["state", "priority", "batch_id", "number"],
    )
    op.create_index("ix_analysis_tasks_batch_id_state", "analysis_tasks", ["batch_id", "state"])
    op.create_table(
        "analysis_task_recordings",
        sa.Column("batch_id", ID, nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("position", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("recording_id", ID, nullable=False),
        sa.ForeignKeyConstraint(
            ["batch_id", "number"],
            ["analysis_tasks.batch_id", "analysis_tasks.number"],
            name=op.f("fk_analysis_task_recordings_batch_id_analysis_tasks"),
        ),
        sa.ForeignKeyConstraint(
            ["recording_id"], ["recordings.id"], name=op.f("fk_analysis_task_recordings_recording_id_recordings")
        ),
        sa.PrimaryKeyConstraint("batch_id", "number", "position", name=op.f("pk_analysis_task_recordings")),
    )
    op.create_index("ix_analysis_task_recordings_recording_id", "analysis_task_recordings", ["recording_id"])
    op.create_table(
        "result_contents",
        sa.Column("content", ID, nullable=False),
        sa.Column("result_id", ID, nullable=False),
        sa.ForeignKeyConstraint(["result_id"], ["results.id"], name=op.f("fk_result_contents_result_id_results")),
        sa.PrimaryKeyConstraint("content", name=op.f("pk_result_contents")),
    )


def downgrade() -> None:
    op.drop_table("result_contents")
    op.drop_table("analysis_task_recordings")
    op.drop_table("analysis_tasks")
    op.drop_table("analysis_batches")
