"""first tables

Revision: 0001, after nothing
"""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
MOMENT = sa.DateTime(timezone=True)
DOCUMENT = sa.JSON(none_as_null=True)
FLOAT = sa.Float(precision=53)


def upgrade() -> None:
    op.create_table(
        "benches",
        sa.Column("id", ID, nullable=False),
        sa.Column("document", DOCUMENT, nullable=False),
        sa.Column("updated_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_benches")),
    )
    op.create_table(
        "idempotency_keys",
        sa.Column("key", ID, nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("fingerprint", sa.String(), nullable=False),
        sa.Column("made_id", ID, nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("key", name=op.f("pk_idempotency_keys")),
    )
    op.create_table(
        "jobs",
        sa.Column("id", ID, nullable=False),
        sa.Column("procedure", sa.String(), nullable=False),
        sa.Column("procedure_version", sa.String(), nullable=False),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("bench", sa.String(), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("requested_parameters", DOCUMENT, nullable=False),
        sa.Column("parameters", DOCUMENT, nullable=False),
        sa.Column("context", DOCUMENT, nullable=False),
        sa.Column("stations", DOCUMENT, nullable=False),
        sa.Column("duration_s", FLOAT, nullable=False),
        sa.Column("code_version", sa.String(), nullable=False),
        sa.Column("simulated", sa.Boolean(), nullable=False),
        sa.Column("seed", sa.BigInteger(), nullable=True),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("labels", DOCUMENT, nullable=False),
        sa.Column("verdict", sa.String(), nullable=True),
        sa.Column("stations_done", sa.Integer(), nullable=False),
        sa.Column("cancel_requested", sa.Boolean(), nullable=False),
        sa.Column("started_at", MOMENT, nullable=True),
        sa.Column("finished_at", MOMENT, nullable=True),
        sa.Column("result_id", ID, nullable=True),
        sa.Column("failure", DOCUMENT, nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_jobs")),
    )
    op.create_index("ix_jobs_procedure_id", "jobs", ["procedure", "id"], unique=False)
    op.create_index("ix_jobs_state_id", "jobs", ["state", "id"], unique=False)
    op.create_index("ix_jobs_unit_id", "jobs", ["unit", "id"], unique=False)

    op.create_table(
        "units",
        sa.Column("serial", ID, nullable=False),
        sa.Column("document", DOCUMENT, nullable=False),
        sa.Column("updated_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("serial", name=op.f("pk_units")),
    )
    op.create_table(
        "events",
        sa.Column("job_id", ID, nullable=False),
        sa.Column("sequence", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("at", MOMENT, nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("data", DOCUMENT, nullable=False),
        sa.ForeignKeyConstraint(["job_id"], ["jobs.id"], name=op.f("fk_events_job_id_jobs")),
        sa.PrimaryKeyConstraint("job_id", "sequence", name=op.f("pk_events")),
    )
    op.create_table(
        "recordings",
        sa.Column("id", ID, nullable=False),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("bench", sa.String(), nullable=True),
        sa.Column("job_id", ID, nullable=True),
        sa.Column("station_index", sa.Integer(), nullable=True),
        sa.Column("station", DOCUMENT, nullable=True),
        sa.Column("channels", DOCUMENT, nullable=False),
        sa.Column("rate_hz", FLOAT, nullable=False),
        sa.Column("start_s", FLOAT, nullable=False),
        sa.Column("sample_type", sa.String(), nullable=False),
        sa.Column("samples", sa.BigInteger(), nullable=False),
        sa.Column("chunk_rows", sa.Integer(), nullable=False),
        sa.Column("chunks", sa.Integer(), nullable=False),
        sa.Column("stored_bytes", sa.BigInteger(), nullable=False),
        sa.Column("content_hash", sa.String(), nullable=False),
        sa.Column("simulated", sa.Boolean(), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("source", DOCUMENT, nullable=False),
        sa.Column("checkpoint", DOCUMENT, nullable=True),
        sa.ForeignKeyConstraint(["job_id"], ["jobs.id"], name=op.f("fk_recordings_job_id_jobs")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_recordings")),
    )
    op.create_index("ix_recordings_job_id_id", "recordings", ["job_id", "id"], unique=False)
    op.create_index("ix_recordings_unit_id", "recordings", ["unit", "id"], unique=False)
    op.create_index(
        "uq_recordings_complete_station",
        "recordings",
        ["job_id", "station_index"],
        unique=True,
        sqlite_where=sa.text("state = 'complete'"),
        postgresql_where=sa.text("state = 'complete'"),
    )

    op.create_table(
        "results",
        sa.Column("id", ID, nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("version", sa.String(), nullable=False),
        sa.Column("parameters", DOCUMENT, nullable=False),
        sa.Column("document", DOCUMENT, nullable=False),
        sa.Column("verdict", sa.String(), nullable=False),
        sa.Column("code_version", sa.String(), nullable=False),
        sa.Column("simulated", sa.Boolean(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("unit", sa.String(), nullable=True),
        sa.Column("job_id", ID, nullable=True),
        sa.Column("seed", sa.BigInteger(), nullable=True),
        sa.Column("context", DOCUMENT, nullable=False),
        sa.ForeignKeyConstraint(["job_id"], ["jobs.id"], name=op.f("fk_results_job_id_jobs")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_results")),
    )
    op.create_index("ix_results_job_id_id", "results", ["job_id", "id"], unique=False)
    op.create_index("ix_results_unit_id", "results", ["unit", "id"], unique=False)

    op.create_table(
        "calibrations",
        sa.Column("id", ID, nullable=False),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("result_id", ID, nullable=False),
        sa.Column("made_at", MOMENT, nullable=False),
        sa.Column("is_current", sa.Boolean(), nullable=False),
        sa.Column("triads", DOCUMENT, nullable=False),
        sa.Column("simulated", sa.Boolean(), nullable=False),
        sa.ForeignKeyConstraint(["result_id"], ["results.id"], name=op.f("fk_calibrations_result_id_results")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_calibrations")),
    )
    op.create_index("ix_calibrations_unit_id", "calibrations", ["unit", "id"], unique=False)
    op.create_index(
        "uq_calibrations_current_unit",
        "calibrations",
        ["unit"],
        unique=True,
        sqlite_where=sa.text("is_current"),
        postgresql_where=sa.text("is_current"),
    )

    op.create_table(
        "chunks",
        sa.Column("recording_id", ID, nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("start_sample", sa.BigInteger(), nullable=False),
        sa.Column("samples", sa.Integer(), nullable=False),
        sa.Column("sha256", sa.String(), nullable=False),
        sa.Column("payload", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["recording_id"], ["recordings.id"], name=op.f("fk_chunks_recording_id_recordings")),
        sa.PrimaryKeyConstraint("recording_id", "number", name=op.f("pk_chunks")),
    )
    op.create_table(
        "result_recordings",
        sa.Column("result_id", ID, nullable=False),
        sa.Column("position", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("recording_id", ID, nullable=False),
        sa.Column("content_hash", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(
            ["recording_id"], ["recordings.id"], name=op.f("fk_result_recordings_recording_id_recordings")
        ),
        sa.ForeignKeyConstraint(["result_id"], ["results.id"], name=op.f("fk_result_recordings_result_id_results")),
        sa.PrimaryKeyConstraint("result_id", "position", name=op.f("pk_result_recordings")),
    )
    op.create_index("ix_result_recordings_recording_id", "result_recordings", ["recording_id"], unique=False)

    op.create_table(
        "result_calibrations",
        sa.Column("result_id", ID, nullable=False),
        sa.Column("position", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("calibration_id", ID, nullable=False),
        sa.ForeignKeyConstraint(
            ["calibration_id"], ["calibrations.id"], name=op.f("fk_result_calibrations_calibration_id_calibrations")
        ),
        sa.ForeignKeyConstraint(["result_id"], ["results.id"], name=op.f("fk_result_calibrations_result_id_results")),
        sa.PrimaryKeyConstraint("result_id", "position", name=op.f("pk_result_calibrations")),
    )
    op.create_index("ix_result_calibrations_calibration_id", "result_calibrations", ["calibration_id"], unique=False)
    if op.get_bind().dialect.name == "postgresql":
        # The payload is compressed already: the server need not try.
        op.execute("ALTER TABLE chunks ALTER COLUMN payload SET STORAGE EXTERNAL")


def downgrade() -> None:

    op.drop_table("result_calibrations")

    op.drop_table("result_recordings")
    op.drop_table("chunks")

    op.drop_table("calibrations")

    op.drop_table("results")

    op.drop_table("recordings")
    op.drop_table("events")
    op.drop_table("units")

    op.drop_table("jobs")
    op.drop_table("idempotency_keys")
    op.drop_table("benches")
