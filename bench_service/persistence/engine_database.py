"""Database of a bench's job engine: a file next to the service's SQLite file, or a schema of the same Postgres
database, which the engines of all benches share.

On SQLite the engine writes with ``synchronous=NORMAL``: a power cut may take back its last entries, and then a
step is done again, which every step allows; the service's own database, whose writes it acknowledges, uses FULL.

Under Python 3.12 and newer the engine asks SQLite for the time as ``unixepoch('subsec')``, also in the defaults of its
tables. An SQLite library older than 3.42 does not know that modifier and answers NULL, so our connections bring the
function along.
"""

import sqlite3
from typing import Any

from sqlalchemy import make_url

from bench_service import wall_clock
from bench_service.persistence.database import TCP, connect

KNOWS_SUBSEC = (3, 42, 0)
"""First version of SQLite whose ``unixepoch`` has milliseconds."""


class _Books(sqlite3.Connection):
    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.execute("PRAGMA synchronous=NORMAL")
        if sqlite3.sqlite_version_info < KNOWS_SUBSEC:
            self.create_function("unixepoch", 1, unix_epoch)
            self.execute("PRAGMA trusted_schema=ON")  # a table's default may call it, however the library was built


def unix_epoch(modifier: str) -> float:
    """``unixepoch('subsec')`` as SQLite 3.42 defines it: seconds since 1970 with three decimals.

    Raises `ValueError` for whatever else the function may be asked: the engine asks for nothing else.
    """
    if modifier not in ("subsec", "subsecond"):
        raise ValueError(f"unixepoch({modifier!r}): only 'subsec' is known here")
    return round(wall_clock.now().timestamp(), 3)


def engine_database(database_url: str, bench_id: str) -> tuple[str, dict[str, Any]]:
    """Return URL and connection options of the database of a bench's engine. An SQLite file is switched to WAL here."""
    if make_url(database_url).get_backend_name() != "sqlite":
        return database_url, {"connect_args": {**TCP, "application_name": f"bench {bench_id} engine"[:63]}}
    beside = f"{database_url}.{bench_id}.jobs"
    connect(beside).dispose()
    return beside, {"connect_args": {"factory": _Books}}
