"""Write `newest_form.sql`: what the migrations make of an empty SQLite database, for first starts."""

from pathlib import Path
from tempfile import TemporaryDirectory

from bench_service.persistence.database import connect
from bench_service.persistence.migration import newest_revision, upgrade
from bench_service.persistence.upkeep.newest_form import FILE, newest_form_of


def main() -> None:
    """Run all migrations on an empty database, and write down its form."""
    with TemporaryDirectory() as folder:
        database = connect(f"sqlite:///{Path(folder) / 'empty.db'}")
        with database.write_connection() as connection:
            upgrade(connection, "head")
        with database.write_connection() as connection:
            FILE.write_text(newest_form_of(connection, newest_revision()), encoding="utf-8")
        database.dispose()


if __name__ == "__main__":
    main()
