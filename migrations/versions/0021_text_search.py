"""labels of stations and names of imported files as columns of recordings, and indexes for searches and trends

Revision: 0021, after 0020
"""

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None

KEY_LENGTH = 500
"""Most characters of a text that is the key of an index: Postgres takes 2704 bytes, and a character has up to four."""
OF_A_TREND = ["unit", "name", "simulated", "id", "job_id", "created_at", "code_version"]
LABEL = {
    "sqlite": "json_extract(station, '$.label')",
    "postgresql": "station ->> 'label'",
}
NAMES = {
    "sqlite": (
        "(SELECT group_concat(json_extract(value, '$.name'), char(10)) FROM json_each(source, '$.files'))",
        "json_array_length(source, '$.files') > 0",
    ),
    "postgresql": (
        "(SELECT string_agg(value ->> 'name', chr(10)) FROM json_array_elements(source -> 'files'))",
        "json_typeof(source -> 'files') = 'array'",
    ),
}


def upgrade() -> None:
    dialect = op.get_bind().dialect.name
    op.add_column("recordings", sa.Column("station_label", sa.String(), nullable=True))
    op.add_column("recordings", sa.Column("file_names", sa.String(), nullable=True))
    op.execute(f"UPDATE recordings SET station_label = {LABEL[dialect]} WHERE station IS NOT NULL")
    names, where = NAMES[dialect]
    op.execute(f"UPDATE recordings SET file_names = {names} WHERE {where}")
    op.create_index("ix_recordings_bench_id", "recordings", ["bench", "id"])
    for column in ("station_label", "file_names"):
        short, long = (sa.text(f"length({column}) {bound} {KEY_LENGTH}") for bound in ("<=", ">"))
        _index(f"ix_recordings_{column}_id", [column, "id"], short)
        _index(f"ix_recordings_long_{column}", ["id"], long)
    op.create_index("ix_jobs_requested_by_id", "jobs", ["requested_by", "id"])
    op.create_index("ix_jobs_result_id_id", "jobs", ["result_id", "id"])
    op.create_index("ix_results_unit_name_simulated_id", "results", OF_A_TREND)


def _index(name: str, columns: list[str], where: sa.TextClause) -> None:
    op.create_index(name, "recordings", columns, sqlite_where=where, postgresql_where=where)


def downgrade() -> None:
    op.drop_index("ix_results_unit_name_simulated_id", "results")
    op.drop_index("ix_jobs_result_id_id", "jobs")
    op.drop_index("ix_jobs_requested_by_id", "jobs")
    for name in ("long_file_names", "file_names_id", "long_station_label", "station_label_id", "bench_id"):
        op.drop_index(f"ix_recordings_{name}", "recordings")
    op.drop_column("recordings", "file_names")
    op.drop_column("recordings", "station_label")
