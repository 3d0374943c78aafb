"""Where the job engine keeps its own books: beside our SQLite file, or in a schema of the same Postgres database."""

from sqlalchemy import make_url

from bench_service.persistence.database import connect


def engine_database_url(database_url: str) -> str:
    """The engine's database for ours. An SQLite file is switched to WAL, which the engine does not do by itself."""
    url = make_url(database_url)
    if url.get_backend_name() != "sqlite":
        return database_url
    beside = f"{database_url}.jobs"
    connect(beside).dispose()
    return beside
