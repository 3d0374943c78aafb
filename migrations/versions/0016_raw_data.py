"""where the raw data of a recording are, and holds on it

Revision: 0016, after 0015
"""

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.add_column("recordings", sa.Column("raw", sa.String(), nullable=False, server_default="stored"))
    op.add_column("recordings", sa.Column("raw_changed_at", MOMENT, nullable=True))
    op.add_column("recordings", sa.Column("archive", sa.String(), nullable=True))
    op.create_index("ix_recordings_raw_state_stored_bytes", "recordings", ["raw", "state", "stored_bytes"])
    op.create_table(
        "recording_holds",
        sa.Column("id", ID, nullable=False),
        sa.Column("recording_id", ID, nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
        sa.Column("by", sa.String(), nullable=False),
        sa.Column("held_at", MOMENT, nullable=False),
        sa.Column("released_at", MOMENT, nullable=True),
        sa.Column("released_by", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(
            ["recording_id"], ["recordings.id"], name=op.f("fk_recording_holds_recording_id_recordings")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_recording_holds")),
    )
    op.create_index("ix_recording_holds_recording_id", "recording_holds", ["recording_id"])


def downgrade() -> None:
    op.drop_table("recording_holds")
    op.drop_index("ix_recordings_raw_state_stored_bytes", "recordings")
    for name in ("archive", "raw_changed_at", "raw"):
        op.drop_column(
            "recordings", name
        )  # in place: recordings made anew would be dropped under the rows that name them
