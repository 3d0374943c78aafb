"""queue, reservations, retries, prompts; live state, audit; campaigns and schedules; thermal corrections

Revision: 0004, after 0003
"""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
MOMENT = sa.DateTime(timezone=True)
DOCUMENT = sa.JSON(none_as_null=True)


def upgrade() -> None:
    _jobs()
    _benches()
    _campaigns()
    _corrections()


def _jobs() -> None:
    op.add_column("jobs", sa.Column("queued_at", MOMENT, nullable=True))
    op.add_column("jobs", sa.Column("not_before", MOMENT, nullable=True))
    op.add_column("jobs", sa.Column("retries", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("jobs", sa.Column("retries_left", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("jobs", sa.Column("reservation", ID, nullable=True))
    op.add_column("jobs", sa.Column("requested_by", sa.String(), nullable=False, server_default=""))
    op.add_column("jobs", sa.Column("prompt", DOCUMENT, nullable=True))
    op.execute("UPDATE jobs SET queued_at = created_at")
    op.create_index("ix_jobs_bench_state", "jobs", ["bench", "state"])


def _benches() -> None:
    op.create_table(
        "reservations",
        sa.Column("id", ID, nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("name", ID, nullable=False),
        sa.Column("holder", sa.String(), nullable=False),
        sa.Column("note", sa.String(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("until", MOMENT, nullable=False),
        sa.Column("ended_at", MOMENT, nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_reservations")),
    )
    op.create_index("ix_reservations_kind_name", "reservations", ["kind", "name"])
    op.create_table(
        "bench_live",
        sa.Column("bench", ID, nullable=False),
        sa.Column("at", MOMENT, nullable=False),
        sa.Column("host", sa.String(), nullable=False),
        sa.Column("process", sa.Integer(), nullable=False),
        sa.Column("job_id", ID, nullable=True),
        sa.Column("document", DOCUMENT, nullable=False),
        sa.PrimaryKeyConstraint("bench", name=op.f("pk_bench_live")),
    )
    op.create_table(
        "audit",
        sa.Column("id", ID, nullable=False),
        sa.Column("at", MOMENT, nullable=False),
        sa.Column("who", sa.String(), nullable=False),
        sa.Column("action", sa.String(), nullable=False),
        sa.Column("target", sa.String(), nullable=False),
        sa.Column("outcome", sa.String(), nullable=False),
        sa.Column("detail", DOCUMENT, nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_audit")),
    )


def _campaigns() -> None:
    op.create_table(
        "campaigns",
        sa.Column("name", ID, nullable=False),
        sa.Column("document", DOCUMENT, nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("updated_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("name", name=op.f("pk_campaigns")),
    )
    op.create_table(
        "campaign_runs",
        sa.Column("id", ID, nullable=False),
        sa.Column("campaign", ID, nullable=False),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("bench", ID, nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("verdict", sa.String(), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("finished_at", MOMENT, nullable=True),
        sa.Column("schedule_id", ID, nullable=True),
        sa.Column("document", DOCUMENT, nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_campaign_runs")),
    )
    op.create_index("ix_campaign_runs_campaign_id", "campaign_runs", ["campaign", "id"])
    op.create_index("ix_campaign_runs_state_id", "campaign_runs", ["state", "id"])
    op.create_table(
        "schedules",
        sa.Column("id", ID, nullable=False),
        sa.Column("campaign", ID, nullable=False),
        sa.Column("enabled", sa.Boolean(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("next_at", MOMENT, nullable=True),
        sa.Column("last_at", MOMENT, nullable=True),
        sa.Column("document", DOCUMENT, nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_schedules")),
    )


def _corrections() -> None:
    op.create_table(
        "corrections",
        sa.Column("id", ID, nullable=False),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("result_id", ID, nullable=False),
        sa.Column("made_at", MOMENT, nullable=False),
        sa.Column("is_current", sa.Boolean(), nullable=False),
        sa.Column("simulated", sa.Boolean(), nullable=False),
        sa.Column("document", DOCUMENT, nullable=False),
        sa.ForeignKeyConstraint(["result_id"], ["results.id"], name=op.f("fk_corrections_result_id_results")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_corrections")),
    )
    op.create_index("ix_corrections_unit_id", "corrections", ["unit", "id"])
    op.create_index(
        "uq_corrections_current_unit",
        "corrections",
        ["unit"],
        unique=True,
        sqlite_where=sa.text("is_current"),
        postgresql_where=sa.text("is_current"),
    )
    op.create_table(
        "result_corrections",
        sa.Column("result_id", ID, nullable=False),
        sa.Column("position", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("correction_id", ID, nullable=False),
        sa.ForeignKeyConstraint(["result_id"], ["results.id"], name=op.f("fk_result_corrections_result_id_results")),
        sa.ForeignKeyConstraint(
            ["correction_id"], ["corrections.id"], name=op.f("fk_result_corrections_correction_id_corrections")
        ),
        sa.PrimaryKeyConstraint("result_id", "position", name=op.f("pk_result_corrections")),
    )
    op.create_index("ix_result_corrections_correction_id", "result_corrections", ["correction_id"])


def downgrade() -> None:
    for table in ("result_corrections", "corrections", "schedules", "campaign_runs", "campaigns"):
        op.drop_table(table)
    for table in ("audit", "bench_live", "reservations"):
        op.drop_table(table)
    op.drop_index("ix_jobs_bench_state", "jobs")
    for column in ("prompt", "requested_by", "reservation", "retries_left", "retries", "not_before", "queued_at"):
        op.drop_column("jobs", column)
