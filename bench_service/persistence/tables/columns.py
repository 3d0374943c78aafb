"""Column types and the root of all tables. Knows SQL types only; what rows mean is written in the ports of its room.

Documents are JSON, not JSONB, on Postgres too: they come back with their own order of keys and spelling of numbers, the
same on both databases, and nothing searches inside them. Ids sort by time, so every list is an index walk.
"""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    JSON,
    ColumnElement,
    DateTime,
    Dialect,
    Index,
    MetaData,
    String,
    func,
    literal_column,
    text,
)
from sqlalchemy.orm import DeclarativeBase, InstrumentedAttribute
from sqlalchemy.types import TypeDecorator

from bench_service.mapping import field_names

KEY_LENGTH = 500
"""Most characters of a text that is the key of an index: Postgres takes 2704 bytes, and a character has up to four."""


class UtcDateTime(TypeDecorator[datetime]):
    """A moment with its time zone, stored and returned as UTC on every database."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"{value!r} has no time zone")
        return value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


Document = JSON(none_as_null=True)
Id = String().with_variant(String(collation="C"), "postgresql")
"""Compared byte by byte, whatever the database's language."""


class Table(DeclarativeBase):
    """Root class of all SQL tables, with the metadata that migrations compare."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
            "pk": "pk_%(table_name)s",
        }
    )
    type_annotation_map = {  # noqa: RUF012  read once by SQLAlchemy
        datetime: UtcDateTime,
        dict[str, Any]: Document,
        list[Any]: Document,
    }


def columns(table: type[Table], shape: type) -> tuple[InstrumentedAttribute[Any], ...]:
    """Columns of a table that match a data class, in the order of its fields."""
    return tuple(getattr(table, name) for name in field_names(shape))


def short_and_long(table: str, column: str) -> tuple[Index, Index]:
    """Indexes of a text without a bound: one has the short texts themselves, the other only the rows of long ones."""
    short, long = (text(f"length({column}) {bound} {KEY_LENGTH}") for bound in ("<=", ">"))
    return (
        Index(f"ix_{table}_{column}_id", column, "id", sqlite_where=short, postgresql_where=short),
        Index(f"ix_{table}_long_{column}", "id", sqlite_where=long, postgresql_where=long),
    )


def is_short(column: Any) -> ColumnElement[bool]:
    """Condition of the index of short texts; a bound that were a parameter would leave that index unused."""
    return func.length(column) <= literal_column(str(KEY_LENGTH))


def is_long(column: Any) -> ColumnElement[bool]:
    """Condition of the index of long texts' rows, as `is_short`."""
    return func.length(column) > literal_column(str(KEY_LENGTH))
