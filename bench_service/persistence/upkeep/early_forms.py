"""Repair of databases that hold an early form of migration 0004, which was edited three times after it had landed.

A database that was made in those two hours has the number 0004 and lacks columns, indexes, or both. What it lacks is
added here before any later migration runs. A database that lacks nothing is left as it is.
"""

from typing import Any

import sqlalchemy as sa
from sqlalchemy import Connection, Inspector

FIRST, LAST = "0004", "0007"
"""Revisions between which a database may still lack a part of 0004; later ones were mended on their way."""
_INDEXES = {
    "ix_jobs_finished_at_id": ("jobs", ["finished_at", "id"]),
    "ix_recordings_state_stored_bytes": ("recordings", ["state", "stored_bytes"]),
}


def mend(connection: Connection, revision: str | None) -> list[str]:
    """Add what a database of this revision lacks of migration 0004; return the names of the parts that were added.
    Nothing in an empty database (None), or in one outside the revisions `FIRST` … `LAST`.
    """
    if revision is None or not FIRST <= revision <= LAST:
        return []
    from alembic.migration import MigrationContext
    from alembic.operations import Operations

    op, found = Operations(MigrationContext.configure(connection)), sa.inspect(connection)
    return [*_corrections(op, found), *_stops(op, found), *_indexes(op, found)]


def _corrections(op: Any, found: Inspector) -> list[str]:
    if "kind" in _columns(found, "corrections"):
        return []
    # No version of the service with that form stored a correction, so the default has no row to speak for.
    op.add_column("corrections", sa.Column("kind", sa.String(), nullable=False, server_default="thermal"))
    if "uq_corrections_current_unit" in _names(found, "corrections"):
        op.drop_index("uq_corrections_current_unit", table_name="corrections")
    current = sa.text("is_current")
    op.create_index(
        "uq_corrections_current_unit_kind",
        "corrections",
        ["unit", "kind"],
        unique=True,
        sqlite_where=current,
        postgresql_where=current,
    )
    return ["corrections.kind"]


def _stops(op: Any, found: Inspector) -> list[str]:
    if "safe_at" in _columns(found, "bench_stops"):
        return []
    op.add_column("bench_stops", sa.Column("safe_at", sa.DateTime(timezone=True), nullable=True))
    op.add_column("bench_stops", sa.Column("safe_by", sa.String(), nullable=False, server_default=""))
    return ["bench_stops.safe_at", "bench_stops.safe_by"]


def _indexes(op: Any, found: Inspector) -> list[str]:
    missing = [name for name, (table, _) in _INDEXES.items() if name not in _names(found, table)]
    for name in missing:
        op.create_index(name, *_INDEXES[name])
    return missing


def _columns(found: Inspector, table: str) -> set[str]:
    return {column["name"] for column in found.get_columns(table)}


def _names(found: Inspector, table: str) -> set[str | None]:
    return {index["name"] for index in found.get_indexes(table)}
