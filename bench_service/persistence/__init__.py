"""Stores in SQL: SQLite on one machine, Postgres for many, the same code. Knows no HTTP and no job engine.

`open_stores` is the way in; `acquire_lease` is the right to drive a bench. Every error of the database leaves here as
`StorageFull` or `StorageFailure`. A supervisor takes lease and database alone: what stores load, it does without.
"""

from typing import TYPE_CHECKING

from bench_service.persistence.bench.lease import BenchLease, acquire_lease, lease_holder
from bench_service.persistence.database import Database
from bench_service.persistence.engine_database import engine_database

if TYPE_CHECKING:
    from pathlib import Path

    from bench_service.campaigns.stores import Stores

__all__ = ["BenchLease", "Database", "acquire_lease", "engine_database", "lease_holder", "open_stores"]


def open_stores(database_url: str, copies: "Path | None" = None) -> "tuple[Stores, Database]":
    """Open and return all stores behind a URL, in the newest form; see
    `bench_service.persistence.stores.open_stores`.
    """
    from bench_service.persistence.stores import open_stores as opened

    return opened(database_url, copies)
