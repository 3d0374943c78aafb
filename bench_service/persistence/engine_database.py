"""Where the job engine of a bench keeps its own books: a file beside our SQLite file, or a schema of the same Postgres
database, which the engines of all benches share.

On SQLite the books are written with ``synchronous=NORMAL``: a power cut may take back their last entries, and then a
step is done again, which every step allows; what we acknowledge ourselves is written with FULL.
"""

import sqlite3
from typing import Any

from sqlalchemy import make_url

from bench_service.persistence.database import TCP, connect


class _Books(sqlite3.Connection):
    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.execute("PRAGMA synchronous=NORMAL")


def engine_database(database_url: str, bench_id: str) -> tuple[str, dict[str, Any]]:
    """URL and connection options of the database of a bench's engine. An SQLite file is switched to WAL here."""
    if make_url(database_url).get_backend_name() != "sqlite":
        return database_url, {"connect_args": {**TCP, "application_name": f"bench {bench_id} engine"[:63]}}
    beside = f"{database_url}.{bench_id}.jobs"
    connect(beside).dispose()
    return beside, {"connect_args": {"factory": _Books}}
