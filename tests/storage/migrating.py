"""A database of an older form: what tests of migrations begin with."""

import sqlalchemy as sa
from alembic import command
from alembic.config import Config

from bench_service.persistence import Database
from bench_service.persistence.migration import SCRIPTS


def migrated(database: Database, to: str) -> None:
    """Bring a database to a revision, up or down."""
    config = Config()
    config.set_main_option("script_location", str(SCRIPTS))
    with database.write_connection() as connection:
        config.attributes["connection"] = connection
        now = "0"
        if sa.inspect(connection).has_table("alembic_version"):
            now = connection.scalar(sa.text("SELECT version_num FROM alembic_version")) or "0"
        (command.upgrade if int(to) > int(now) else command.downgrade)(config, to)
