"""How Alembic reaches the database: the connection that the service hands over, or `BENCH_DATABASE_URL`."""

import os

from alembic import context
from sqlalchemy import Connection

from bench_service.persistence.database import connect
from bench_service.persistence.tables.every import METADATA
from bench_service.settings import Settings


def _migrate(connection: Connection) -> None:
    context.configure(
        connection=connection,
        target_metadata=METADATA,
        render_as_batch=connection.dialect.name == "sqlite",
        compare_type=True,
    )
    with context.begin_transaction():
        context.run_migrations()


if context.is_offline_mode():
    raise SystemExit("migrations run on a live database only")

given = context.config.attributes.get("connection")
if given is not None:
    _migrate(given)
else:
    database = connect(Settings.from_environ(os.environ).database_url)
    with database.write_connection() as own:
        _migrate(own)
    database.dispose()
