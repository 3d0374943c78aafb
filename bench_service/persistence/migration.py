"""Migration of a database to the newest form of its tables, at start. Knows Alembic; must not know what tables hold.

All of it is one writing transaction, so of two processes that start at once the second waits and finds the work done.
Alembic is imported only where there is work: a service that starts on a database of its own version does without.
"""

from pathlib import Path

from sqlalchemy import Connection, inspect, text

from bench_service.model.errors import StorageFailure
from bench_service.persistence.database import Database, storage_errors

SCRIPTS = Path(__file__).resolve().parents[2] / "migrations"
_LOCK = 0x62656E63  # "benc": the advisory lock of those who migrate


def upgrade_to_head(database: Database) -> None:
    """Run every migration that the database has not seen. Raises `StorageFailure`."""
    with storage_errors(), database.engine.connect() as connection:
        if _revision(connection) == _head():
            return
    with database.write_connection() as connection:
        if database.is_postgres:
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _LOCK})
        _run(connection)


def _head() -> str:
    """Return the newest revision: the number that begins the last script's name."""
    scripts = sorted(SCRIPTS.glob("versions/[0-9][0-9][0-9][0-9]_*.py"))
    if not scripts:
        raise StorageFailure(f"the folder of migrations is missing: {SCRIPTS}")
    return scripts[-1].name[:4]


def _revision(connection: Connection) -> str | None:
    """Read the revision of the database; None for an empty one."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    return connection.scalar(text("SELECT version_num FROM alembic_version"))


def _run(connection: Connection) -> None:
    from alembic import command
    from alembic.config import Config
    from alembic.util import CommandError

    config = Config()
    config.set_main_option("script_location", str(SCRIPTS))
    config.attributes["connection"] = connection
    try:
        command.upgrade(config, "head")
    except CommandError as error:
        raise StorageFailure(f"the database is of another version of this service: {error}") from error
