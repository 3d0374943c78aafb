"""Migration of a database to the newest form of its tables, at start. Knows Alembic; must not know what tables hold.

All of it is one writing transaction, so of two processes that start at once the second waits and finds the work done.
Before anything is changed a copy of the database is made. Alembic is imported only where there is work: a service that
starts on a database of its own version does without.
"""

import logging
from collections.abc import Callable
from pathlib import Path

from sqlalchemy import Connection, inspect, text

from bench_service.model.errors import StorageFailure
from bench_service.persistence.database import Database, storage_errors
from bench_service.persistence.upkeep.early_forms import mend
from bench_service.persistence.upkeep.newest_form import put_newest_form

SCRIPTS = Path(__file__).resolve().parents[2] / "migrations"
_LOCK = 0x62656E63  # "benc": the advisory lock of those who migrate

log = logging.getLogger(__name__)


def upgrade_to_head(database: Database, keep: Callable[[str, str], object] = lambda old, new: None) -> None:
    """Run every migration that the database has not seen. Raises `StorageFailure`.

    `keep(old, new)`, the revisions before and after, is called before anything is changed in a database with tables.
    """
    with storage_errors(), database.engine.connect() as connection:
        if revision_of(connection) == newest_revision():
            return
    with database.write_connection() as connection:
        if database.is_postgres:
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _LOCK})
        revision = revision_of(connection)
        if revision == newest_revision():  # another process was faster
            return
        _check_known(revision)
        if revision is not None:
            keep(revision, newest_revision())
        if revision is None and _is_empty(connection) and put_newest_form(connection, newest_revision()):
            return
        mended = mend(connection, revision)
        if mended:
            log.warning("the database had an early form of revision %s; added: %s", revision, ", ".join(mended))
        upgrade(connection, "head")


def _is_empty(connection: Connection) -> bool:
    """Return whether this is an SQLite database without any table."""
    return connection.dialect.name == "sqlite" and not inspect(connection).get_table_names()


def newest_revision() -> str:
    """Return the newest revision: the number that begins the last script's name."""
    return _revisions()[-1]


def _revisions() -> list[str]:
    scripts = sorted(SCRIPTS.glob("versions/[0-9][0-9][0-9][0-9]_*.py"))
    if not scripts:
        raise StorageFailure(f"the folder of migrations is missing: {SCRIPTS}")
    return [script.name[:4] for script in scripts]


def _check_known(revision: str | None) -> None:
    if revision is not None and revision not in _revisions():
        raise StorageFailure(
            f"the database is of another version of this service: it has revision {revision}, and the newest one here "
            f"is {newest_revision()}: start the version that opened it, or restore the copy that was made before"
        )


def revision_of(connection: Connection) -> str | None:
    """Return the revision of the database; None for an empty one."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    return connection.scalar(text("SELECT version_num FROM alembic_version"))


def upgrade(connection: Connection, revision: str) -> None:
    """Run migrations up to a revision in the connection's transaction. Raises `StorageFailure`."""
    from alembic import command
    from alembic.config import Config
    from alembic.util import CommandError

    config = Config()
    config.set_main_option("script_location", str(SCRIPTS))
    config.attributes["connection"] = connection
    try:
        command.upgrade(config, revision)
    except CommandError as error:
        raise StorageFailure(f"the database is of another version of this service: {error}") from error
