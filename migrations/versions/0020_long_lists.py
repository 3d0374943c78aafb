"""labels of jobs as rows, and indexes of what long lists are restricted by

Revision: 0020, after 0019
"""

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
INDEXES = {
    "ix_jobs_verdict_id": ("jobs", ["verdict", "id"]),
    "ix_jobs_bench_id": ("jobs", ["bench", "id"]),
    "ix_jobs_id_procedure_unit_bench_requested_by": ("jobs", ["id", "procedure", "unit", "bench", "requested_by"]),
    "ix_recordings_simulated_id": ("recordings", ["simulated", "id"]),
    "ix_results_name_id": ("results", ["name", "id"]),
    "ix_results_verdict_id": ("results", ["verdict", "id"]),
    "ix_results_id_name_unit_job_id": ("results", ["id", "name", "unit", "job_id"]),
}
LABELS = {"sqlite": "json_each(labels)", "postgresql": "json_each_text(labels)"}


def upgrade() -> None:
    op.create_table(
        "job_labels",
        sa.Column("job_id", ID, nullable=False),
        sa.Column("name", ID, nullable=False),
        sa.Column("value", ID, nullable=False),
        sa.ForeignKeyConstraint(["job_id"], ["jobs.id"], name=op.f("fk_job_labels_job_id_jobs")),
        sa.PrimaryKeyConstraint("job_id", "name", name=op.f("pk_job_labels")),
    )
    pairs = LABELS[op.get_bind().dialect.name]
    op.execute(
        f"INSERT INTO job_labels (job_id, name, value) SELECT jobs.id, pair.key, pair.value FROM jobs, {pairs} pair"
    )
    op.create_index("ix_job_labels_name_value_job_id", "job_labels", ["name", "value", "job_id"])
    op.create_index("ix_job_labels_name_job_id", "job_labels", ["name", "job_id"])
    for name, (table, columns) in INDEXES.items():
        op.create_index(name, table, columns)


def downgrade() -> None:
    for name, (table, _) in INDEXES.items():
        op.drop_index(name, table)
    op.drop_table("job_labels")
