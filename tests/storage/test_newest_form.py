"""The file with the newest form of an empty database is what the migrations make, and each database has its secret."""

from pathlib import Path

import sqlalchemy as sa

from bench_service.persistence import open_stores
from bench_service.persistence.database import connect
from bench_service.persistence.migration import newest_revision, upgrade
from bench_service.persistence.upkeep.newest_form import FILE, newest_form_of, put_newest_form


def objects(connection: sa.Connection) -> set[tuple[object, ...]]:
    """Everything in the schema: kind, name, table and SQL."""
    return {tuple(row) for row in connection.execute(sa.text("SELECT type, name, tbl_name, sql FROM sqlite_master"))}


def test_the_file_is_what_the_migrations_make_now(tmp_path: Path) -> None:
    migrated, quick = connect(f"sqlite:///{tmp_path / 'migrated.db'}"), connect(f"sqlite:///{tmp_path / 'quick.db'}")
    with migrated.write_connection() as one, quick.write_connection() as other:
        upgrade(one, "head")
        made = newest_form_of(one, newest_revision())
        assert FILE.read_text(encoding="utf-8") == made, "the migrations changed: `make newest-form`"
        assert put_newest_form(other, newest_revision())
        assert objects(other) == objects(one)
        assert newest_form_of(other, newest_revision()) == made
    migrated.dispose()
    quick.dispose()


def test_each_database_draws_a_secret_of_its_own_and_another_revision_is_left_to_the_migrations(tmp_path: Path) -> None:
    secrets = set[str]()
    for name in ("a", "b"):
        _, database = open_stores(f"sqlite:///{tmp_path / name}.db")
        with database.write_connection() as connection:
            secrets.add(connection.scalar(sa.text("SELECT key FROM access_state")))
        database.dispose()
    assert len(secrets) == 2
    assert all(len(bytes.fromhex(secret)) == 32 for secret in secrets)
    empty = connect(f"sqlite:///{tmp_path / 'empty.db'}")
    with empty.write_connection() as connection:
        assert not put_newest_form(connection, "0010")
        assert objects(connection) == set()
    empty.dispose()
